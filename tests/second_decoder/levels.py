"""Directories, chunks, levels (sections 4, 5 and 6 of the specification)."""

import struct
from collections import namedtuple

import bricks
from header import BRICKS, CHUNKS, DIRECTORY, EXPANSION, need_zeros
from streams import PLANES, Part, Planes, filter_of, fold_bits, need, unfilter, unpack_part, unrank, xxh3
from values import COLOUR, INTEGER_NORMALS, MATERIAL, NORMAL, RADIUS, SHADOW, TEXEL, dot, pack565

Chunk = namedtuple("Chunk", "prefix hash points nodes parents bricks parent axis cosine depth zero at offset parts")

class Level:
    """A decoded level: masks (one per node of the level above), Morton codes of its nodes, and for each attribute stream the
    bytes of all nodes; lit fractions take one byte each."""

    def __init__(self, streams):
        self.masks, self.codes, self.values = bytearray(), [], [bytearray() for _ in streams]

def raw_sizes(m, level, nodes, points):
    """5.4: raw sizes of masks and attribute streams of a chunk."""
    def size(s):
        sizes = {NORMAL: 2 * points, COLOUR: points * (1 + s.format), SHADOW: (s.bits[level] * points + 7) // 8}
        return sizes.get(s.kind, points)
    return [nodes] + [size(s) for s in m.streams]

def stream_end(m, offset):
    """5.5, 5.10.1: where what follows a stream begins; `offset` is the stream's end. (Chunks sections of mapped files start
    at multiples of 4,096, so that of 64 too.)"""
    return -(-offset // 64) * 64 if m.mapped else offset

def read_parts(m, level, chunk, offset, end):
    """5.4: the streams of a chunk that starts at `offset`; `end` is the end of its section."""
    parts = []
    for i, raw in enumerate(raw_sizes(m, level, chunk.nodes, chunk.points)):
        at = chunk.at + 48 + 4 * i
        word, = struct.unpack_from("<I", m.data, at)
        size, filter_id, zstd = word & 0xFFFFFF, word >> 24 & 127, word >> 31
        need(filter_id in (0, filter_of(m.streams[i - 1] if i else None)), "unsupported_feature", at, "5.4.1")
        if filter_id:
            need(not zstd and 4 * PLANES[filter_id] <= size < raw, "bad_directory", at, "5.4.2")
        else:
            need(1 <= size < raw if zstd else size == raw, "bad_directory", at, "5.4.2")
        need(raw < EXPANSION * (size + 1), "too_large", at, "5.4.3")
        need(not m.mapped or not (filter_id or zstd), "bad_directory", chunk.at + 48, "5.4.4")
        need(stream_end(m, offset + size) <= end, "bad_directory", chunk.at + 48, "5.5.8")
        parts.append(Part(offset, size, raw, filter_id, zstd))
        offset = stream_end(m, offset + size)
    return parts

def chunk_end(m, c):
    """The end of a chunk's stored bytes."""
    return stream_end(m, c.parts[-1].offset + c.parts[-1].stored)

def check_counts(m, level, c):
    """5.3 and 5.5.2 for one entry."""
    def rule(condition, field, number):
        need(condition, "bad_directory", c.at + field, number)
    rule(not any(c.zero), 41, "5.5.2")
    rule(c.depth <= max(0, level - 3), 40, "5.3.1")
    rule(c.prefix < 8 ** c.depth, 0, "5.3.2")
    rule(1 <= c.points <= m.limit, 16, "5.3.3")
    rule(c.nodes <= c.points <= 8 * c.nodes, 20, "5.3.4")
    rule(c.parents <= c.nodes <= 8 * c.parents if level >= 2 else (c.nodes, c.parents) == (1, 0), 24, "5.3.5")
    rule(c.bricks <= c.parents <= 8 * c.bricks if level >= 3 else c.bricks == 1, 28, "5.3.6")
    rule(level != 2 or c.parents == 1, 28, "5.3.6")
    rule(c.axis < 8192 and c.cosine >= -32767 and (c.cosine > -32767 or c.axis == 0), 36, "5.3.7")

class ParentChunks:
    """5.5.4 to 5.5.7, 5.5.9: the chunks of the level above, filled one after the other. There is none for level 1."""

    def __init__(self, above):
        self.above, self.number, self.nodes, self.parents = above, 0, 0, 0

    def fill(self, c, first):
        """Put the entry `c` into its parent chunk."""
        if not self.above:
            need(first and c.parent == 0, "bad_directory", c.at + 32, "5.5.4")
            return
        if not first and self.nodes == self.above[self.number].points:
            self.number, self.nodes, self.parents = self.number + 1, 0, 0
        need(c.parent == self.number < len(self.above), "bad_directory", c.at + 32, "5.5.5")
        p = self.above[self.number]
        need(c.depth >= p.depth and c.prefix >> 3 * (c.depth - p.depth) == p.prefix, "bad_directory", c.at, "5.5.6")
        self.nodes, self.parents = self.nodes + c.nodes, self.parents + c.parents
        within = self.nodes <= p.points and self.parents <= p.nodes
        need(within and (self.nodes == p.points) == (self.parents == p.nodes), "bad_directory", c.at + 20, "5.5.7")

    def full(self):
        return not self.above or self.number == len(self.above) - 1 and self.nodes == self.above[-1].points

def check_order(level, c, before):
    """5.5.3: subtrees ascend."""
    end = (before.prefix + 1) << 3 * (level - before.depth) if before else 0
    need(c.prefix << 3 * (level - c.depth) >= end, "bad_directory", c.at, "5.5.3")

def read_directory(m, level, above):
    """5.3 to 5.5: the entries of a level, given those of the level above."""
    e, section = m.section[DIRECTORY, level], m.section[CHUNKS, level]
    size = 48 + 4 * (1 + len(m.streams))
    need(e.raw > 0 and e.raw % size == 0, "bad_directory", e.offset, "5.5.1")
    chunks, offset, end, parents = [], section.offset, section.offset + section.stored, ParentChunks(above)
    for at in range(e.offset, e.offset + e.raw, size):
        c = Chunk(*struct.unpack_from("<QQIIIIIHhB7s", m.data, at), at, offset, None)
        check_counts(m, level, c)
        c = c._replace(parts=read_parts(m, level, c, offset, end))
        check_order(level, c, chunks[-1] if chunks else None)
        parents.fill(c, not chunks)
        offset = chunk_end(m, c)
        chunks.append(c)
    need(parents.full(), "bad_directory", e.offset + e.stored, "5.5.9")
    stored_bytes = offset - section.offset
    raw_bytes = stored_bytes if m.mapped else sum(p.raw for c in chunks for p in c.parts)
    sums = (stored_bytes, raw_bytes, sum(c.points for c in chunks))
    need(sums == (section.stored, section.raw, section.count), "bad_directory", e.offset + e.stored, "5.5.10")
    need(e.count == len(chunks), "bad_directory", e.at + 48, "5.5.11")
    if m.mapped:
        bricks.check_section(m.section[BRICKS, level], chunks)
    return chunks

def check_values(m, level, c, part, stream, data):
    """5.7 and section 6: the bytes of one attribute stream of a chunk."""
    at = part.offset
    if stream.kind == NORMAL:
        normals = set(struct.unpack(f"<{c.points}H", data))
        need(max(normals) < 0x4000, "bad_attribute", at, "6.1.4")
        for normal in normals:
            need(normal < 0x2000 or c.cosine == -32767, "bad_attribute", at, "5.7.1")
            inside = dot(INTEGER_NORMALS[c.axis], INTEGER_NORMALS[normal & 8191]) >= 32767 * c.cosine
            need(inside or c.cosine == -32767, "bad_attribute", at, "5.7.1")
    elif stream.kind == RADIUS:
        need(level < m.depth or max(data) <= 203, "bad_attribute", at, "6.2.2")
    elif stream.kind == MATERIAL:
        need(max(data) < len(m.materials), "bad_attribute", at, "6.4.1")

def level_0(m):
    """Section 2: the root record as a level of one node."""
    out, colour = Level(m.streams), tuple(m.root[2:5])
    out.codes = [0]
    for s, values in zip(m.streams, out.values):
        if s.kind == COLOUR:
            values += struct.pack("<H", pack565(colour)) if s.format == 1 else bytes(colour)
        else:
            values += {NORMAL: m.root[:2], MATERIAL: m.root[5:6], RADIUS: m.root[6:7], TEXEL: m.root[7:8],
                       SHADOW: m.root[8 + s.light:9 + s.light]}[s.kind]
    return out

def read_masks(m, c, above, node, parent):
    """5.6, 5.9, 4.2, 4.4: the masks of a chunk whose first node and parent have these numbers in their levels."""
    part = c.parts[0]
    if part.filter:
        normals = struct.unpack(f"<{c.nodes}H", above.values[m.index[NORMAL, 0]][2 * node:2 * (node + c.nodes)])
        masks = unrank(Planes(m, part).take(c.nodes), normals, above.masks[parent:parent + c.parents])
    else:
        masks = unpack_part(m, part, part.offset)
    need(0 not in masks, "bad_octree", c.offset, "4.2")
    need(sum(bin(k).count("1") for k in masks) == c.points, "bad_octree", c.offset, "4.4")
    return masks

def check_stream_padding(m, c):
    """5.10.1: zero bytes between the streams of a chunk and behind them."""
    for p in c.parts:
        end = p.offset + p.stored
        need_zeros(m, end, stream_end(m, end), "bad_attribute", "5.10.1")

def read_level(m, level, chunks, above):
    """5.6 to 5.9, 4.2 to 4.4 and section 6: all chunks of a level; `above` is the level above."""
    out, node, parent, brick = Level(m.streams), 0, 0, 0
    for c in chunks:
        need(c.hash == xxh3(m.data[c.offset:chunk_end(m, c)]), "bad_hash", c.offset, "5.6.4")
        check_stream_padding(m, c)
        masks = read_masks(m, c, above, node, parent)
        counts = [bin(k).count("1") for k in masks]
        for stream, part, values, parents in zip(m.streams, c.parts[1:], out.values, above.values):
            if part.filter:
                size = len(parents) // len(above.codes)
                nodes = parents[size * node:size * (node + c.nodes)]
                data = unfilter(level, m.depth, stream, Planes(m, part), nodes, counts)
            else:
                data = unpack_part(m, part, part.offset)
                if stream.kind == SHADOW:
                    data = fold_bits(part, data, stream.bits[level], c.points)
            check_values(m, level, c, part, stream, data)
            values += data
        if m.mapped:
            normals, radii = (m.data[p.offset:p.offset + p.stored] for p in c.parts[1:3])
            at = m.section[BRICKS, level].offset + bricks.SIZE * brick
            bricks.check_chunk(m, level, c, above.codes, node, counts, normals, radii, at)
        out.masks += masks
        node, parent, brick = node + c.nodes, parent + c.parents, brick + c.bricks
    need(len(out.masks) == len(above.codes), "bad_octree", m.section[CHUNKS, level].offset, "4.3")
    out.codes = [8 * code + i for code, mask in zip(above.codes, out.masks) for i in range(8) if mask >> i & 1]
    return out

def child_starts(masks):
    """The number of the first child of each node, and the number of children of all."""
    starts = [0]
    for mask in masks:
        starts.append(starts[-1] + bin(mask).count("1"))
    return starts

def check_chunk_rule(m, level):
    """5.1, 5.2: the entries are the maximal subtrees with at most N points, with the counts of the octree."""
    def below(depth, node, to):
        """The numbers of the nodes of level `to` below a node, itself included."""
        first, last = node, node + 1
        for k in range(depth, to):
            first, last = m.starts[k][first], m.starts[k][last]
        return range(first, last)
    found, todo = [], [(0, 0)]
    while todo:
        root = todo.pop()
        if len(below(*root, level)) > m.limit:
            todo += [(root[0] + 1, child) for child in reversed(below(*root, root[0] + 1))]
        else:
            counts = [len(below(*root, level - k)) if level >= k else int(k == 3) for k in range(4)]
            found.append((root[0], m.levels[root[0]].codes[root[1]], *counts))
    for i, c in enumerate(m.directories[level]):
        same = i < len(found) and found[i] == (c.depth, c.prefix, c.points, c.nodes, c.parents, c.bricks)
        need(same, "bad_directory", c.at, "5.2")
    need(len(found) == len(m.directories[level]), "bad_directory", m.section[DIRECTORY, level].offset, "5.2")
