"""A second decoder and validator of .bvg files, written from the text of the specification alone.

Numbers in brackets are paragraphs of the specification. `read(data)` proves every rule and returns a Model; the first
broken rule raises BvgError with the code of section 9, an offset in the file and the rule.
Needs the Debian packages python3-zstandard and python3-xxhash; 100,000 points take about five seconds.
"""

import json
import math
import struct
from collections import namedtuple

import xxhash

import bricks
import rasters
from averages import Sums, root_record
from streams import PLANES, BvgError, Part, Planes, filter_of, fold_bits, need, unfilter, unpack_part, unrank, xxh3
from values import (COLOUR, INTEGER_NORMALS, MATERIAL, NORMAL, RADIUS, SHADOW, TEXEL, Stream, dot, expand565, pack565)

MAGIC = b"\x89BVG\r\n\x1a\n"
METADATA, GRID, ATTRIBUTES, MATERIALS, LIGHTS, TEXTURE, GROUND, DIRECTORY, CHUNKS, BRICKS = 1, 2, 3, 4, 5, 6, 7, 16, 17, 18
RASTERS = (rasters.GROUND_TEXTURE, rasters.GROUND_LIT, rasters.PANORAMA)
PLACES = {DIRECTORY: 0, BRICKS: 1, CHUNKS: 2}           # 3.2.2: the sections of a level
EXPANSION = 32768                                       # section 10: raw bytes per stored byte

Entry = namedtuple("Entry", "type codec flags instance element alignment zero offset stored raw count hash at")
Chunk = namedtuple("Chunk", "prefix hash points nodes parents bricks parent axis cosine depth zero at offset parts")

class Level:
    """A decoded level: masks (one per node of the level above), Morton codes of its nodes, and for each attribute stream
    the bytes of all nodes; lit fractions take one byte each."""

    def __init__(self, streams):
        self.masks, self.codes, self.values = bytearray(), [], [bytearray() for _ in streams]

class Model:
    """What a file holds: header fields, sections, streams, directories and levels."""

def f32(v):
    """The binary32 nearest to a bound in the text."""
    return struct.unpack("<f", struct.pack("<f", v))[0]

def stored(m, e):
    return m.data[e.offset:e.offset + e.stored]

def power_of_two(v, low, high):
    return low <= v <= high and v & (v - 1) == 0

# ---- 2, 3: header and sections

def read_header(m):
    """Section 2, rules 2.1 to 2.13."""
    data = m.data
    need(data[:8] == MAGIC, "not_bvg", 0, "2.1")
    need(len(data) >= 128, "truncated", len(data), "2.2")
    (_, major, minor, tag, size, table, m.sections, m.depth, zero, required, _, m.points, m.raw, m.content_id, m.root,
     m.limit, zero2, m.table_hash, hash64) = struct.unpack_from("<8sHHIQQIB3sQQQQ16s16sI4sQQ", data)
    need(hash64 == xxh3(data[:120]), "bad_hash", 0, "2.3")
    need(tag == 0x01020304, "bad_header", 12, "2.4")
    need((major, minor) == (0, 3), "unsupported_version", 8, "2.5")
    need(required & ~1 == 0, "unsupported_feature", 40, "2.6")
    m.mapped = required == 1
    need(len(data) >= size, "truncated", len(data), "2.7")
    need(len(data) == size, "bad_header", size, "2.7")
    need(not any(zero), "bad_header", 37, "2.8")
    need(not any(zero2), "bad_header", 108, "2.8")
    need(2 <= m.depth <= 16, "bad_header", 36, "2.9")
    need(1 <= m.points < 2 ** 32, "bad_header", 56, "2.10")
    need(power_of_two(m.limit, 512, 65536), "bad_header", 104, "2.11")
    need(table == 128, "bad_header", 24, "2.12")
    need(m.root[1] & 0xC0 == 0, "bad_header", 88, "2.13")

def check_entry(m, e, before, end):
    """3.2: one entry of the table; `before` is the entry before, `end` the end of its section."""
    def key(x):
        return (DIRECTORY if x.type in PLACES else x.type, x.instance, PLACES.get(x.type, 0))
    def rule(condition, field, number, code="bad_table"):
        need(condition, code, e.at + field, number)
    levels = e.type in PLACES
    coded = e.type == CHUNKS or e.type in RASTERS
    known = e.type in range(1, 8) or levels or e.type in RASTERS
    most = 7 if e.type == rasters.GROUND_LIT else 0
    rule(e.zero == 0, 20, "3.2.1")
    rule(before is None or key(before) < key(e), 0, "3.2.2")
    rule(known or not e.flags & 1, 0, "3.2.4", "unsupported_feature")
    rule(not known or e.codec == (coded and not m.mapped), 4, "3.2.5", "unsupported_feature")
    rule(e.flags & ~1 == 0, 6, "3.2.6")
    rule(not known or (1 <= e.instance <= m.depth if levels else e.instance <= most), 8, "3.2.7")
    rule(power_of_two(e.alignment, 8, 65536), 16, "3.2.8")
    rule(e.codec != 0 or e.raw == e.stored, 40, "3.2.9")
    rule(e.raw < EXPANSION * (e.stored + 1), 40, "3.2.10", "too_large")
    if coded:
        rule(e.element == 0, 12, "3.2.13")
    elif known:
        rule(e.element > 0 and e.element * e.count == e.raw, 12, "3.2.13")
    rule(m.mapped or e.type != BRICKS, 0, "3.2.15")
    rule(not m.mapped or e.alignment == {CHUNKS: 4096, BRICKS: 64, **dict.fromkeys(RASTERS, 64)}.get(e.type, e.alignment), 16, "3.2.16")
    rule(e.offset == -(-end // e.alignment) * e.alignment, 24, "3.2.3")
    need(e.offset + e.stored <= len(m.data), "truncated", len(m.data), "3.2.11")

def read_table(m):
    """3.1, 3.2 and the hashes of the raw sections (3.3). Sections are kept by (type, instance)."""
    need(1 <= m.sections <= 256, "bad_header", 32, "3.1.1")
    end = 128 + 64 * m.sections
    need(end <= len(m.data), "truncated", len(m.data), "3.1.2")
    need(m.table_hash == xxh3(m.data[128:end]), "bad_hash", 128, "3.1.3")
    m.entries, m.section, before = [], {}, None
    for at in range(128, 128 + 64 * m.sections, 64):
        e = Entry(*struct.unpack_from("<IHHIIIIQQQQQ", m.data, at), at)
        check_entry(m, e, before, end)
        before, end = e, e.offset + e.stored
        m.entries.append(e)
        m.section[e.type, e.instance] = e
    total = sum(e.raw for e in m.entries)
    need(total < 2 ** 64, "bad_table", 128, "3.1.4")
    need(end == len(m.data), "bad_table", end, "3.1.5")
    need(total == m.raw, "bad_header", 64, "3.1.6")
    need(all((t, 0) in m.section for t in (METADATA, GRID, ATTRIBUTES, MATERIALS)), "bad_table", 128, "3.1.7")
    of_levels = (DIRECTORY, BRICKS, CHUNKS) if m.mapped else (DIRECTORY, CHUNKS)
    need(all((t, level) in m.section for t in of_levels for level in range(1, m.depth + 1)), "bad_table", 128, "3.1.8")
    need(m.section[CHUNKS, m.depth].count == m.points, "bad_header", 56, "2.18")

def need_zeros(m, first, end, code, rule):
    """Padding is zero; the offset of the error is that of the first byte which is not."""
    need(not any(m.data[first:end]), code, next((i for i in range(first, end) if m.data[i]), end), rule)

def check_padding(m):
    """3.2.12: zero bytes from the table to the first section and between sections."""
    end = 128 + 64 * m.sections
    for e in m.entries:
        need_zeros(m, end, e.offset, "bad_table", "3.2.12")
        end = e.offset + e.stored

def check_hashes(m, types):
    """3.3: the stored bytes of sections match their hashes."""
    for e in m.entries:
        if types(e.type):
            need(e.hash == xxh3(stored(m, e)), "bad_hash", e.offset, "3.2.14")

def read_metadata(m, e):
    """3.3: one JSON object in at most 4,096 bytes of UTF-8."""
    need(e.stored <= 4096, "bad_section", e.offset, "3.3.1")
    def refuse(name):
        raise ValueError(name)
    def number(text):
        return float(text) if abs(float(text)) != float("inf") else refuse(text)
    def depth(value):
        inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
        return 1 + max(map(depth, inner), default=0) if isinstance(value, (dict, list)) else 0
    try:
        m.metadata = json.loads(stored(m, e).decode("utf-8"), parse_constant=refuse, parse_float=number)
        need(depth(m.metadata) <= 32, "bad_section", e.offset, "3.3.2")
    except (ValueError, RecursionError):
        raise BvgError("bad_section", e.offset, "3.3.2") from None
    need(isinstance(m.metadata, dict), "bad_section", e.offset, "3.3.3")

def read_grid(m, e):
    """3.4."""
    need(e.raw == 48, "bad_section", e.offset, "3.4.1")
    *m.corner, m.voxel, m.unit, m.up, zero = struct.unpack("<4dBB14s", stored(m, e))
    for i, c in enumerate(m.corner):
        need(math.isfinite(c) and math.isfinite(c + m.voxel * 2.0 ** m.depth), "bad_section", e.offset + 8 * i, "3.4.2")
    need(2.0 ** -1022 <= m.voxel < math.inf, "bad_section", e.offset + 24, "3.4.3")
    need(m.unit <= 6, "bad_section", e.offset + 32, "3.4.4")
    need(m.up <= 2, "bad_section", e.offset + 33, "3.4.5")
    need(not any(zero), "bad_section", e.offset + 34, "3.4.6")

def read_attributes(m, e):
    """3.5: the streams of a chunk after its masks."""
    need(e.raw % 24 == 0, "bad_section", e.offset, "3.5.1")
    m.streams = []
    for at in range(e.offset, e.offset + e.raw, 24):
        kind, form, light, zero, bits, zero2 = struct.unpack_from("<BBBB17s3s", m.data, at)
        need(NORMAL <= kind <= SHADOW, "unsupported_feature", at, "3.5.2")
        before = (m.streams[-1].kind, m.streams[-1].light) if m.streams else (0, 0)
        shadows = sum(s.kind == SHADOW for s in m.streams)
        need(before < (kind, light) and light == (shadows if kind == SHADOW else 0) and light < 8, "bad_section", at, "3.5.3")
        need(form in (1, 2) if kind == COLOUR else form == 0, "unsupported_feature", at + 1, "3.5.4")
        for level, b in enumerate(bits):
            allowed = (1, 2, 4, 8) if kind == SHADOW and level <= m.depth else (0,)
            need(b in allowed, "bad_section", at + 4 + level, "3.5.5")
        need(zero == 0 and not any(zero2), "bad_section", at, "3.5.6")
        m.streams.append(Stream(kind, form, light, bits))
    m.index = {(s.kind, s.light): i for i, s in enumerate(m.streams)}
    need((NORMAL, 0) in m.index and (RADIUS, 0) in m.index, "bad_section", e.offset, "3.5.7")
    m.shadows = [s for s in m.streams if s.kind == SHADOW]

def records(m, e, size, rule):
    """The records of `size` bytes of a section with 1 to 8 of them, with their offsets."""
    need(e.raw % size == 0 and 1 <= e.raw // size <= 8, "bad_section", e.offset, rule)
    return [(at, m.data[at:at + size]) for at in range(e.offset, e.offset + e.raw, size)]

def read_materials(m, e):
    """3.6."""
    m.materials = []
    for at, record in records(m, e, 32, "3.6.1"):
        ka, kd, ks, exponent, colour, zero, blend, zero2 = struct.unpack("<4f3sBf8s", record)
        need(all(0 <= k <= 1 for k in (ka, kd, ks)), "bad_section", at, "3.6.2")
        need(f32(1e-6) <= exponent <= 1024, "bad_section", at + 12, "3.6.3")
        need(0 <= blend <= 1, "bad_section", at + 20, "3.6.4")
        need(zero == 0 and not any(zero2), "bad_section", at + 19, "3.6.5")
        m.materials.append((ka, kd, ks, exponent, tuple(colour), blend))

def read_lights(m, e):
    """3.7."""
    for at, record in records(m, e, 48, "3.7.1"):
        kind, zero, *v, spot, zero2 = struct.unpack("<B3s10f4s", record)
        need(kind <= 2, "bad_section", at, "3.7.2")
        need(all(0 <= i <= 1e6 for i in v[:3]), "bad_section", at + 4, "3.7.3")
        need(all(map(math.isfinite, v[3:6])), "bad_section", at + 16, "3.7.4")
        need(0.998 <= sum(x * x for x in v[6:9]) <= 1.002, "bad_section", at + 28, "3.7.5")
        need(0 <= spot <= 1024, "bad_section", at + 40, "3.7.6")
        need(not any(zero) and not any(zero2), "bad_section", at + 1, "3.7.7")
        m.lights.append((kind, v[:3], v[3:6], v[6:9], spot))

def texture_record(m, at):
    """3.8.2 to 3.8.4."""
    kind, zero, seed, scale, turbulence, zero2, palette = struct.unpack_from("<B3sIff16s768s", m.data, at)
    need(kind in (1, 2), "bad_section", at, "3.8.2")
    need(f32(1e-9) <= scale <= 1e9 and 0 <= turbulence <= 1e6, "bad_section", at + 8, "3.8.3")
    need(not any(zero) and not any(zero2), "bad_section", at + 1, "3.8.4")
    return kind, seed, scale, turbulence, palette

def read_texture(m, e):
    """3.8."""
    need(e.raw == 800, "bad_section", e.offset, "3.8.1")
    m.texture = texture_record(m, e.offset)

def read_ground(m, e):
    """3.11: centre, half edge, material, texture or None."""
    need(e.raw in (32, 832), "bad_section", e.offset, "3.11.1")
    *centre, half, material, zero = struct.unpack_from("<4fB15s", m.data, e.offset)
    need(all(map(math.isfinite, centre)), "bad_section", e.offset, "3.11.2")
    need(2.0 ** -126 <= half < math.inf, "bad_section", e.offset + 12, "3.11.3")
    need(not any(zero), "bad_section", e.offset + 17, "3.11.4")
    m.ground = (centre, half, material, texture_record(m, e.offset + 32) if e.raw == 832 else None)

def check_together(m):
    """3.9, and 2.14 to 2.17: the root record fits the sections."""
    attributes = m.section[ATTRIBUTES, 0].offset
    need(len(m.lights) >= len(m.shadows), "bad_section", attributes, "3.9.1")
    need((m.texture is not None) == ((TEXEL, 0) in m.index), "bad_section", attributes, "3.9.2")
    of_ground = m.ground[2] if m.ground else 0
    several = len(m.materials) == 2 and of_ground == 1
    need((MATERIAL, 0) in m.index or len(m.materials) == 1 or several, "bad_section", attributes, "3.9.3")
    need(of_ground < len(m.materials), "bad_section", attributes, "3.9.4")
    textured = m.ground is not None and m.ground[3] is not None
    need(((rasters.GROUND_TEXTURE, 0) in m.section) == textured, "bad_section", attributes, "3.9.5")
    lit = [e.instance for e in m.entries if e.type == rasters.GROUND_LIT]
    need(not lit or m.ground and lit == [s.light for s in m.shadows], "bad_section", attributes, "3.9.6")
    colour = tuple(m.root[2:5])
    if (COLOUR, 0) not in m.index:
        need(colour == (0, 0, 0), "bad_header", 90, "2.14")
    elif m.streams[m.index[COLOUR, 0]].format == 1:
        need(colour == expand565(pack565(colour)), "bad_header", 90, "2.14")
    need(m.root[5] < len(m.materials), "bad_header", 93, "2.15")
    need((TEXEL, 0) in m.index or m.root[7] == 0, "bad_header", 95, "2.16")
    for i, lit in enumerate(m.root[8:]):
        need(lit < (2 ** m.shadows[i].bits[0] if i < len(m.shadows) else 1), "bad_header", 96 + i, "2.17")

# ---- 5.3 to 5.5: directories

def raw_sizes(m, level, nodes, points):
    """5.4: raw sizes of masks and attribute streams of a chunk."""
    def size(s):
        return {NORMAL: 2 * points, COLOUR: points * (1 + s.format), SHADOW: (s.bits[level] * points + 7) // 8}.get(s.kind, points)
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
        need(not m.mapped or not (filter_id or zstd), "bad_directory", at, "5.4.4")
        need(stream_end(m, offset + size) <= end, "bad_directory", at, "5.5.8")
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
    rule(level != 2 or c.parents == 1, 24, "5.3.6")
    rule(c.axis < 8192 and c.cosine >= -32767 and (c.cosine > -32767 or c.axis == 0), 36, "5.3.7")

def check_nesting(level, c, before, above):
    """5.5.3 to 5.5.6: the place of an entry after the one before and in its parent chunk."""
    if before:
        end = (before.prefix + 1) << 3 * (level - before.depth)
        need(c.prefix << 3 * (level - c.depth) >= end, "bad_directory", c.at, "5.5.3")
    if level == 1:
        need(before is None, "bad_directory", c.at, "5.5.4")
        need(c.parent == 0, "bad_directory", c.at + 32, "5.5.4")
        return
    need(c.parent in ((before.parent, before.parent + 1) if before else (0,)) and c.parent < len(above),
         "bad_directory", c.at + 32, "5.5.5")
    p = above[c.parent]
    need(c.depth >= p.depth and c.prefix >> 3 * (c.depth - p.depth) == p.prefix, "bad_directory", c.at, "5.5.6")

def check_sums(chunks, above):
    """5.5.7, 5.5.9: parent chunks are filled with their points and nodes. At level 1 there is none."""
    need(not above or chunks[-1].parent == len(above) - 1, "bad_directory", chunks[-1].at + 32, "5.5.9")
    children = [[] for _ in above]
    for c in chunks if above else ():
        children[c.parent].append(c)
    for p, below in zip(above, children):
        sums = (sum(c.nodes for c in below), sum(c.parents for c in below))
        need(sums == (p.points, p.nodes), "bad_directory", below[-1].at + 20, "5.5.7")

def read_directory(m, level, above):
    """5.3 to 5.5: the entries of a level, given those of the level above."""
    e, section = m.section[DIRECTORY, level], m.section[CHUNKS, level]
    size = 48 + 4 * (1 + len(m.streams))
    need(e.raw > 0 and e.raw % size == 0, "bad_directory", e.offset, "5.5.1")
    chunks, offset, end = [], section.offset, section.offset + section.stored
    for at in range(e.offset, e.offset + e.raw, size):
        c = Chunk(*struct.unpack_from("<QQIIIIIHhB7s", m.data, at), at, offset, None)
        check_counts(m, level, c)
        check_nesting(level, c, chunks[-1] if chunks else None, above)
        c = c._replace(parts=read_parts(m, level, c, offset, end))
        offset = chunk_end(m, c)
        chunks.append(c)
    check_sums(chunks, above)
    stored_bytes = offset - section.offset
    raw_bytes = stored_bytes if m.mapped else sum(p.raw for c in chunks for p in c.parts)
    sums = (stored_bytes, raw_bytes, sum(c.points for c in chunks))
    need(sums == (section.stored, section.raw, section.count), "bad_directory", e.offset + e.stored, "5.5.10")
    need(e.count == len(chunks), "bad_directory", e.at + 48, "5.5.11")
    if m.mapped:
        bricks.check_section(m.section[BRICKS, level], chunks)
    return chunks

# ---- 4 to 6: levels

def check_values(m, level, c, part, stream, data):
    """5.7 and section 6: the bytes of one attribute stream of a chunk."""
    at = part.offset
    if stream.kind == NORMAL:
        for normal in set(struct.unpack(f"<{c.points}H", data)):
            need(normal < 0x4000, "bad_attribute", at, "6.1.4")
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
                data = unfilter(m, level, stream, part, parents[size * node:size * (node + c.nodes)], counts)
            else:
                data = unpack_part(m, part, part.offset)
                if stream.kind == SHADOW:
                    data = fold_bits(m, part, data, stream.bits[level], c.points)
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

# ---- 7, 8: averages, all together

def check_averages(m):
    """7.1: levels d - 1 to 0 are the averages of level d."""
    sums = Sums(m)
    for level in reversed(range(m.depth)):
        sums.up(m.starts[level], level)
        if level == 0:
            need(root_record(m, sums) == m.root, "bad_content", 88, "7.1")
            continue
        for s, values in zip(m.streams, m.levels[level].values):
            need(sums.stream(m, s, level) == values, "bad_content", m.section[CHUNKS, level].offset, "7.1")

def content_id(m):
    """8.1."""
    h = xxhash.xxh3_128(struct.pack("<II", m.depth, m.limit))
    for t in (GRID, ATTRIBUTES, MATERIALS, LIGHTS, TEXTURE, GROUND):
        if (t, 0) in m.section:
            h.update(stored(m, m.section[t, 0]))
    for level in range(1, m.depth + 1):
        for c in m.directories[level]:
            h.update(struct.pack("<BQ", c.depth, c.prefix))
        h.update(bytes(m.levels[level].masks))
    for values in m.levels[m.depth].values:
        h.update(bytes(values))
    for e, (width, height, texels) in m.rasters:
        h.update(struct.pack("<4I", e.type, e.instance, width, height) + texels)
    return h.intdigest().to_bytes(16, "little")

def read(data, max_nodes=None):
    """Prove every rule of a file (8.3) and return its Model. `max_nodes` is the limit of 4.5."""
    m = Model()
    m.data, m.lights, m.texture, m.ground = bytes(data), [], None, None
    read_header(m)
    read_table(m)
    check_padding(m)
    check_hashes(m, lambda t: t != CHUNKS)
    for t, parse in ((METADATA, read_metadata), (GRID, read_grid), (ATTRIBUTES, read_attributes),
                     (MATERIALS, read_materials), (LIGHTS, read_lights), (TEXTURE, read_texture), (GROUND, read_ground)):
        if (t, 0) in m.section:
            parse(m, m.section[t, 0])
    check_together(m)
    m.directories = [[]]
    for level in range(1, m.depth + 1):
        m.directories.append(read_directory(m, level, m.directories[-1]))
    total = sum(c.points for chunks in m.directories for c in chunks)
    need(max_nodes is None or total <= max_nodes, "too_large", 56, "4.5")
    m.levels, m.starts = [level_0(m)], []
    for level in range(1, m.depth + 1):
        m.levels.append(read_level(m, level, m.directories[level], m.levels[-1]))
        m.starts.append(child_starts(m.levels[level].masks))
        check_chunk_rule(m, level)
    check_hashes(m, lambda t: t == CHUNKS)
    check_averages(m)
    m.rasters = [(e, rasters.read(m, e)) for e in m.entries if e.type in RASTERS]
    need(content_id(m) == m.content_id, "bad_content", 72, "8.1")
    return m
