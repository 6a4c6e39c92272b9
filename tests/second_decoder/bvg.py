"""A second decoder and validator of .bvg files, written from the text of the specification alone.

Numbers in brackets are paragraphs of the specification. `read(data)` proves every rule and returns a Model; the first
broken rule raises BvgError with the code of section 9, an offset in the file and the rule.
Needs the Debian packages python3-zstandard and python3-xxhash; nothing here is tuned for speed.
"""

import functools
import itertools
import json
import math
import struct
from collections import namedtuple
from pathlib import Path

import xxhash
import zstandard

MAGIC = b"\x89BVG\r\n\x1a\n"
METADATA, GRID, ATTRIBUTES, MATERIALS, LIGHTS, TEXTURE, DIRECTORY, CHUNKS = 1, 2, 3, 4, 5, 6, 16, 17
NORMAL, RADIUS, COLOUR, MATERIAL, TEXEL, SHADOW = range(1, 7)
EXPANSION = 32768                                       # section 10: raw bytes per stored byte

Entry = namedtuple("Entry", "type codec flags instance element alignment zero offset stored raw count hash at")
Stream = namedtuple("Stream", "kind format light bits")
Part = namedtuple("Part", "offset stored raw filter zstd")      # one stream of a chunk in the file, or one plane of it
Chunk = namedtuple("Chunk", "prefix hash points nodes parents bricks parent axis cosine depth zero at offset parts")

class BvgError(Exception):
    """A broken rule: code of section 9, offset in the file, number of the rule."""

    def __init__(self, code, offset, rule):
        super().__init__(f"{code} at {offset}: rule {rule}")
        self.code, self.offset, self.rule = code, offset, rule

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

def need(condition, code, offset, rule):
    if not condition:
        raise BvgError(code, offset, rule)

def xxh3(data):
    return xxhash.xxh3_64_intdigest(data)

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
    need((major, minor) == (0, 2), "unsupported_version", 8, "2.5")
    need(required == 0, "unsupported_feature", 40, "2.6")
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
        return (DIRECTORY if x.type == CHUNKS else x.type, x.instance, x.type)
    def rule(condition, field, number, code="bad_table"):
        need(condition, code, e.at + field, number)
    known, levels = e.type in range(1, 7) or e.type in (DIRECTORY, CHUNKS), e.type in (DIRECTORY, CHUNKS)
    rule(e.zero == 0, 20, "3.2.1")
    rule(before is None or key(before) < key(e), 0, "3.2.2")
    rule(power_of_two(e.alignment, 8, 65536), 16, "3.2.8")
    rule(e.offset == -(-end // e.alignment) * e.alignment, 24, "3.2.3")
    rule(known or not e.flags & 1, 0, "3.2.4", "unsupported_feature")
    rule(not known or e.codec == (e.type == CHUNKS), 4, "3.2.5", "unsupported_feature")
    rule(e.flags & ~1 == 0, 6, "3.2.6")
    rule(not known or (1 <= e.instance <= m.depth if levels else e.instance == 0), 8, "3.2.7")
    rule(e.codec != 0 or e.raw == e.stored, 40, "3.2.9")
    rule(e.raw < EXPANSION * (e.stored + 1), 40, "3.2.10", "too_large")
    need(e.offset + e.stored <= len(m.data), "truncated", len(m.data), "3.2.11")
    if e.type == CHUNKS:
        rule(e.element == 0, 12, "3.2.13")
    elif known:
        rule(e.element > 0 and e.element * e.count == e.raw, 12, "3.2.13")

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
    need(all((t, level) in m.section for t in (DIRECTORY, CHUNKS) for level in range(1, m.depth + 1)), "bad_table", 128, "3.1.8")
    need(m.section[CHUNKS, m.depth].count == m.points, "bad_header", 56, "2.18")

def check_padding(m):
    """3.2.12: zero bytes from the table to the first section and between sections."""
    end = 128 + 64 * m.sections
    for e in m.entries:
        need(not any(m.data[end:e.offset]), "bad_table", end, "3.2.12")
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

def read_texture(m, e):
    """3.8."""
    need(e.raw == 800, "bad_section", e.offset, "3.8.1")
    kind, zero, seed, scale, turbulence, zero2, palette = struct.unpack("<B3sIff16s768s", stored(m, e))
    need(kind in (1, 2), "bad_section", e.offset, "3.8.2")
    need(f32(1e-9) <= scale <= 1e9 and 0 <= turbulence <= 1e6, "bad_section", e.offset + 8, "3.8.3")
    need(not any(zero) and not any(zero2), "bad_section", e.offset + 1, "3.8.4")
    m.texture = (kind, seed, scale, turbulence, palette)

def check_together(m):
    """3.9, and 2.14 to 2.17: the root record fits the sections."""
    attributes = m.section[ATTRIBUTES, 0].offset
    need(len(m.lights) >= len(m.shadows), "bad_section", attributes, "3.9.1")
    need((m.texture is not None) == ((TEXEL, 0) in m.index), "bad_section", attributes, "3.9.2")
    need((MATERIAL, 0) in m.index or len(m.materials) == 1, "bad_section", attributes, "3.9.3")
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

PLANES = {1: 1, 2: 2, 3: 1, 4: 3, 5: 3, 6: 1, 7: 1, 8: 1}

def filter_of(stream):
    """5.8: the filter that a stream may have; None stands for the masks."""
    if stream is None:
        return 1
    return {NORMAL: 2, RADIUS: 3, COLOUR: 3 + stream.format, MATERIAL: 6, TEXEL: 7, SHADOW: 8}[stream.kind]

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
        need(size <= end - offset, "bad_directory", at, "5.5.8")
        parts.append(Part(offset, size, raw, filter_id, zstd))
        offset += size
    return parts

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
        need(before is None and c.parent == 0, "bad_directory", c.at, "5.5.4")
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
        offset = c.parts[-1].offset + c.parts[-1].stored
        chunks.append(c)
    check_sums(chunks, above)
    sums = (offset - section.offset, sum(p.raw for c in chunks for p in c.parts), sum(c.points for c in chunks))
    need(sums == (section.stored, section.raw, section.count), "bad_directory", section.offset, "5.5.10")
    need(e.count == len(chunks), "bad_directory", e.at + 48, "5.5.11")
    return chunks

# ---- 4, 5.6, 5.7, 6: chunks

def unpack_part(m, part, stream):
    """5.6.1 to 5.6.3: the raw bytes of a stored stream, or of a plane of the stream that starts at the offset `stream`."""
    data = m.data[part.offset:part.offset + part.stored]
    if not part.zstd:
        return data
    plain = data[:4] == b"\x28\xb5\x2f\xfd" and len(data) > 4 and data[4] & 0x2B == 0x20
    need(plain, "bad_attribute", stream, "5.6.1")
    try:
        frame = zstandard.get_frame_parameters(data)
        need(frame.content_size == part.raw, "bad_attribute", stream, "5.6.2")
        out = zstandard.ZstdDecompressor().decompress(data, max_output_size=part.raw, allow_extra_data=False)
    except zstandard.ZstdError:
        raise BvgError("bad_attribute", stream, "5.6.3") from None
    need(len(out) == part.raw, "bad_attribute", stream, "5.6.3")
    return out

def fold_bits(m, part, data, bits, count):
    """6.6: the lit fractions (or their codes) of packed bytes, one byte each; bits after the last are zero."""
    need(data[-1] >> 8 - (8 * len(data) - bits * count) == 0, "bad_attribute", part.offset, "6.6.1")
    return bytes(data[i * bits >> 3] >> (i * bits & 7) & (1 << bits) - 1 for i in range(count))

# ---- 5.8: filters

class Planes:
    """The planes of a filtered stream (5.8.1), taken in their order. `take` proves that they are as large as announced;
    `end` that none is left."""

    def __init__(self, m, part):
        self.m, self.part, self.number = m, part, 0
        self.words = struct.unpack_from(f"<{PLANES[part.filter]}I", m.data, part.offset)
        self.offset = part.offset + 4 * len(self.words)
        sizes = sum(word & 0xFFFFFF for word in self.words)
        self.need(not any(word & 0x7F000000 for word in self.words), "5.8.1")
        self.need(self.offset + sizes == part.offset + part.stored, "5.8.1")

    def need(self, condition, rule):
        need(condition, "bad_attribute", self.part.offset, rule)

    def take(self, raw):
        """The next plane, which has `raw` bytes."""
        word, offset = self.words[self.number], self.offset
        size, zstd = word & 0xFFFFFF, word >> 31
        self.need(size < raw if zstd else size == raw, "5.8.1")
        self.number, self.offset = self.number + 1, offset + size
        return unpack_part(self.m, Part(offset, size, raw, 0, zstd), self.part.offset)

    def pairs(self, count):
        """5.8.2: `count` pairs (a, b, whether they are an escape), of two planes."""
        codes = self.take(count)
        escapes = self.take(2 * codes.count(15))
        self.need(not any(code & 15 == 15 and code > 15 for code in codes), "5.8.2")
        escaped = zip(escapes[::2], escapes[1::2], itertools.repeat(True))
        return [next(escaped) if code == 15 else (code & 15, code >> 4, False) for code in codes]

def unfold(z):
    """The difference of which z is the zigzag."""
    return -(z + 1 >> 1) if z & 1 else z >> 1

def unfilter_normals(planes, parents):
    """5.8.3."""
    out = []
    for parent, (a, b, escape) in zip(parents, planes.pairs(len(parents))):
        planes.need(b < 64, "5.8.3")
        u, v = CELLS[parent & 1023]
        index = NORMAL_OF_CELL[(u + unfold(a & 127)) % 128, (v + unfold(b)) % 64]
        out.append(index ^ parent & 0x3C00 ^ (a & 128) << 6)
    return out

def unfilter_colours(form, planes, parents):
    """5.8.5, 5.8.6: colours as triples of the format's own bits."""
    wheel, green_wheel = (32, 64) if form == 1 else (256, 256)
    greens = planes.take(len(parents))
    out = []
    for (r, g, b), code, (red, blue, _) in zip(parents, greens, planes.pairs(len(parents))):
        step = unfold(code)
        h = int(step / 2) if form == 1 else step
        out.append(((r + h + unfold(red)) % wheel, (g + step) % green_wheel, (b + h + unfold(blue)) % wheel))
    return out

@functools.lru_cache(maxsize=None)
def predicted_radius(level, finest, parent):
    """5.8.4: the p of a parent's radius."""
    return max((i for i in range(204 if level == finest else 256) if covering_radius(level - 1, i) <= parent), default=0)

def unfilter_lit(m, level, stream, planes, parents):
    """5.8.8."""
    full, above = 2 ** stream.bits[level] - 1, 2 ** stream.bits[level - 1] - 1
    data = planes.take((stream.bits[level] * len(parents) + 7) // 8)
    codes = fold_bits(m, planes.part, data, stream.bits[level], len(parents))
    return bytes((2 * f * full + above) // (2 * above) + code & full for f, code in zip(parents, codes))

def siblings_of(parents, counts):
    """The parents of the siblings, one for each of them."""
    return [parent for parent, count in zip(parents, counts) if count > 1 for _ in range(count)]

def with_only_children(values, parents, counts):
    """The values of the siblings, and those of the only children, which are their parents', in the order of the points."""
    siblings, out = iter(values), []
    for parent, count in zip(parents, counts):
        out += itertools.islice(siblings, count) if count > 1 else (parent,)
    return out

def unfilter(m, level, stream, part, parents, counts):
    """5.8: an attribute stream's bytes, lit fractions one byte each, from those of the parent nodes; `counts` are the
    parents' numbers of children."""
    planes = Planes(m, part)
    if stream.kind in (RADIUS, SHADOW):
        each = [parent for parent, count in zip(parents, counts) for _ in range(count)]
        if stream.kind == SHADOW:
            return unfilter_lit(m, level, stream, planes, each)
        return bytes(predicted_radius(level, m.depth, parent) - code & 255 for parent, code in zip(each, planes.take(len(each))))
    parents = elements(stream, parents)
    each = siblings_of(parents, counts)
    if stream.kind == NORMAL:
        values = unfilter_normals(planes, each)
    elif stream.kind == COLOUR:
        values = unfilter_colours(stream.format, planes, each)
    elif stream.kind == MATERIAL:
        values = [parent ^ code for parent, code in zip(each, planes.take(len(each)))]
    else:
        values = [parent + unfold(code) & 255 for parent, code in zip(each, planes.take(len(each)))]
    return stream_bytes(stream, with_only_children(values, parents, counts))

def elements(stream, data):
    """The values of a stream: numbers, or colours as triples of the format's own bits."""
    if stream.kind == NORMAL:
        return struct.unpack(f"<{len(data) // 2}H", data)
    if stream.kind == COLOUR and stream.format == 1:
        return [(v >> 11, v >> 5 & 63, v & 31) for v in struct.unpack(f"<{len(data) // 2}H", data)]
    return list(zip(data[::3], data[1::3], data[2::3])) if stream.kind == COLOUR else data

def stream_bytes(stream, values):
    """The inverse of `elements`."""
    if stream.kind == NORMAL:
        return struct.pack(f"<{len(values)}H", *values)
    if stream.kind == COLOUR and stream.format == 1:
        return struct.pack(f"<{len(values)}H", *(r << 11 | g << 5 | b for r, g, b in values))
    return bytes(itertools.chain.from_iterable(values)) if stream.kind == COLOUR else bytes(values)

# ---- 5.9: ranks of masks

@functools.lru_cache(maxsize=None)
def rank_table():
    """5.9.4."""
    lines = Path(__file__, "../../../format_spec/mask_ranks.txt").resolve().read_text(encoding="ascii").splitlines()
    table = bytes.fromhex("".join(line for line in lines if not line.startswith("#")))
    if len(table) != 54272 or xxh3(table) != 0x2302B7EBAB6BD564:
        raise RuntimeError("mask_ranks.txt is not the table of the specification")
    return table

@functools.lru_cache(maxsize=None)
def permuted(places):
    """The images of all masks under a permutation of the places."""
    return bytes(sum(1 << places[p] for p in range(8) if mask >> p & 1) for mask in range(256))

@functools.lru_cache(maxsize=None)
def symmetry(normal):
    """5.9.2, 5.9.3: the class of a normal, the images of places and of masks, and the masks of images."""
    s, c = normal >> 10 & 7, NORMAL_SUMS[normal & 1023]
    i, j, k = next(o for o in itertools.permutations(range(3)) if c[o[0]] >= c[o[1]] >= c[o[2]])
    places = tuple((p ^ s) >> i & 1 | ((p ^ s) >> j & 1) << 1 | ((p ^ s) >> k & 1) << 2 for p in range(8))
    back = tuple(map(places.index, range(8)))
    u, v = 6 * c[j] // (c[i] + 1), 6 * c[k] // (c[i] + 1)
    return u * (u + 1) // 2 + v, places, permuted(places), permuted(back)

MIRRORED = [bytes(sum((m >> (b ^ p) & 1) << b for b in range(8)) for m in range(256)) for p in range(8)]

def unrank(codes, normals, above):
    """5.9: the masks of a chunk. `normals` are those of its nodes, `above` the masks of their parents, none at level 1."""
    table, masks = rank_table(), bytearray()
    places = [(m, p) for m in above for p in range(8) if m >> p & 1]
    for code, normal, (m, p) in zip(codes, normals, itertools.chain(places, itertools.repeat((1, 0)))):
        q, image, images, back = symmetry(normal & 8191)
        context = 1024 * q + 128 * image[p] + (MIRRORED[image[p]][images[m]] >> 1)
        masks.append(back[table[21504 + 256 * table[context] + code]])
    return masks

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

def read_level(m, level, chunks, above):
    """5.6 to 5.9, 4.2 to 4.4 and section 6: all chunks of a level; `above` is the level above."""
    out, node, parent = Level(m.streams), 0, 0
    for c in chunks:
        end = c.parts[-1].offset + c.parts[-1].stored
        need(c.hash == xxh3(m.data[c.offset:end]), "bad_hash", c.offset, "5.6.4")
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
        out.masks += masks
        node, parent = node + c.nodes, parent + c.parents
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

# ---- 6: values

def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

def make_sums():
    """6.1.2: the sums of the corners for the 1,024 indices of the positive octant."""
    def mid(a, b):
        return tuple((i + j) // 2 for i, j in zip(a, b))
    triangles = [((32, 0, 0), (0, 32, 0), (0, 0, 32))]
    for _ in range(5):
        below = []
        for x, y, z in triangles:
            yz, zx, xy = mid(y, z), mid(z, x), mid(x, y)
            below += [(yz, zx, xy), (x, xy, zx), (xy, y, yz), (zx, yz, z)]
        triangles = below
    return [tuple(map(sum, zip(*corners))) for corners in triangles]

def make_normals():
    """6.1.1, 6.1.2: the 8,192 normals in binary64."""
    normals = []
    for signs in range(8):
        for c in NORMAL_SUMS:
            length = math.sqrt(dot(c, c))
            normals.append(tuple((-v if signs >> k & 1 else v) / length for k, v in enumerate(c)))
    return normals

def round_away(v):
    """To an integer, halves away from zero (6.1.5); adding 0.5 is exact enough here, no value lies next to a half."""
    return int(math.copysign(math.floor(abs(v) + 0.5), v))

def cell(index):
    """5.8.3: the place of a normal on the map."""
    x, y, _ = NORMAL_SUMS[index & 1023]
    a, b = (96 - y, 96 - x) if index & 0x1000 else (x, y)
    u, v = 2 * (a // 3) + a % 3 - 1, b // 3
    return 63 - u if index & 0x400 else 64 + u, 31 - v if index & 0x800 else 32 + v

NORMAL_SUMS = make_sums()
NORMALS = make_normals()
CELLS = [cell(i) for i in range(8192)]
NORMAL_OF_CELL = {place: i for i, place in enumerate(CELLS)}
INTEGER_NORMALS = [tuple(round_away(32767 * v) for v in n) for n in NORMALS]

@functools.lru_cache(maxsize=None)
def normal_index(v):
    """6.1.3. The largest product lies in the octant of v; one with a lower index can tie only where all components of the
    other sign vanish in rounding."""
    x, y, z = map(float, v)
    home = (x < 0) | (y < 0) << 1 | (z < 0) << 2
    best = max([(x * a + y * b) + z * c for a, b, c in NORMALS[1024 * home:1024 * home + 1024]])
    for octant in range(home + 1):
        if all(abs(v[k]) * 1e13 <= best for k in range(3) if (octant ^ home) >> k & 1):
            values = [(x * a + y * b) + z * c for a, b, c in NORMALS[1024 * octant:1024 * octant + 1024]]
            if best in values:
                return 1024 * octant + values.index(best)
    raise AssertionError("no normal has the largest product")

K = (1099511627776, 1164891991447, 1234160073853, 1307547050779, 1385297844439, 1467671940878,
     1554944255987, 1647406053004, 1745365914582, 1849150772653, 1959106999532, 2075601563905)
RADII = [K[(i + 9) % 12] >> (22 - (i + 9) // 12) for i in range(256)]                       # 6.2.1

@functools.lru_cache(maxsize=None)
def covering_radius(level, child):
    """6.2.3: the index that covers children of index `child`."""
    least = RADII[child] + (476102500705 >> level)
    return next((i for i, r in enumerate(RADII) if r >= least), 255)

def srgb(v):
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4

LINEAR = [round(65535 * srgb(v / 255)) for v in range(256)]                                 # 6.3.3

@functools.lru_cache(maxsize=None)
def from_linear(v):
    return min(range(256), key=lambda i: abs(LINEAR[i] - v))

def expand565(v):
    """6.3.1, 6.3.2."""
    r, g, b = v >> 11, v >> 5 & 63, v & 31
    return (r << 3 | r >> 2, g << 2 | g >> 4, b << 3 | b >> 2)

def pack565(c):
    r, g, b = ((n * v + 127) // 255 for n, v in zip((31, 63, 31), c))
    return r << 11 | g << 5 | b

def colours(form, data):
    """The colours of a stream, 8 bits a channel."""
    if form == 1:
        return [expand565(v) for v in struct.unpack(f"<{len(data) // 2}H", data)]
    return [tuple(data[i:i + 3]) for i in range(0, len(data), 3)]

# ---- 7: averages

def mean(s, v):
    return (2 * s + v) // (2 * v)

class Sums:
    """What section 7 adds up, for each node of a level: lists that `up` folds into those of the level above."""

    def __init__(self, m):
        values, at = m.levels[m.depth].values, m.index
        stored_normals = struct.unpack(f"<{m.points}H", values[at[NORMAL, 0]])
        normals = [INTEGER_NORMALS[n & 8191] for n in stored_normals]
        self.columns = {"V": [1] * m.points}
        for i in range(3):
            self.columns["S", i] = [n[i] for n in normals]
            for j in range(i, 3):
                self.columns["M", i, j] = [n[i] * n[j] for n in normals]
        for s, data in zip(m.streams, values):
            if s.kind == COLOUR:
                for k, channel in enumerate(zip(*colours(s.format, data))):
                    self.columns["C", k] = [LINEAR[v] for v in channel]
            elif s.kind == MATERIAL:
                for k in range(len(m.materials)):
                    self.columns["votes", k] = [int(v == k) for v in data]
            elif s.kind in (TEXEL, SHADOW):
                self.columns[s.kind, s.light] = list(data)
        self.two_sided = [n >> 13 & 1 for n in stored_normals]
        self.radius = list(values[at[RADIUS, 0]])

    def up(self, starts, level):
        """Fold into `level`, where node i has the children starts[i]..starts[i + 1] - 1 (7.3 to 7.5)."""
        spans = [slice(*ends) for ends in zip(starts, starts[1:])]
        self.columns = {name: [sum(column[s]) for s in spans] for name, column in self.columns.items()}
        self.two_sided = [max(self.two_sided[s]) for s in spans]
        self.radius = [covering_radius(level, max(self.radius[s])) for s in spans]
        self.normals = [self.normal(i) for i in range(len(spans))]

    def normal(self, i):
        """7.2, 7.3: the normal of node i; sets its two-sided flag."""
        c = self.columns
        s = tuple(c["S", k][i] for k in range(3))
        if self.two_sided[i] or 4 * dot(s, s) < (32767 * c["V"][i]) ** 2:
            self.two_sided[i] = 1
            k = max(range(3), key=lambda n: c["M", n, n][i])
            column = tuple(float(c["M", min(j, k), max(j, k)][i]) for j in range(3))
            return 0x2000 | normal_index(tuple(-v for v in column) if dot(column, tuple(map(float, s))) < 0 else column)
        return normal_index(s)

    def stream(self, m, s, level):
        """The values of one stream at the level reached, as Level keeps them."""
        c, votes = self.columns, self.columns["V"]
        if s.kind == NORMAL:
            return struct.pack(f"<{len(votes)}H", *self.normals)
        if s.kind == RADIUS:
            return bytes(self.radius)
        if s.kind == COLOUR:
            rows = [tuple(from_linear(mean(x, v)) for x in sums)
                    for *sums, v in zip(c["C", 0], c["C", 1], c["C", 2], votes)]
            return b"".join(struct.pack("<H", pack565(row)) if s.format == 1 else bytes(row) for row in rows)
        if s.kind == MATERIAL:
            counts = [c["votes", k] for k in range(len(m.materials))]
            return bytes(row.index(max(row)) for row in zip(*counts))
        if s.kind == TEXEL:
            return bytes(mean(x, v) for x, v in zip(c[s.kind, 0], votes))
        finest, here = (255 // (2 ** s.bits[k] - 1) for k in (m.depth, level))
        return bytes(mean(x * finest, v * here) for x, v in zip(c[s.kind, s.light], votes))

def root_record(m, sums):
    """The 16 bytes of section 2, from the streams of level 0."""
    of = {(s.kind, s.light): sums.stream(m, s, 0) for s in m.streams}
    colour = colours(m.streams[m.index[COLOUR, 0]].format, of[COLOUR, 0])[0] if (COLOUR, 0) in of else (0, 0, 0)
    lit = b"".join(of[SHADOW, s.light] for s in m.shadows)
    return (of[NORMAL, 0] + bytes(colour) + of.get((MATERIAL, 0), b"\0") + of[RADIUS, 0] + of.get((TEXEL, 0), b"\0")
            + lit.ljust(8, b"\0"))

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

# ---- 8

def content_id(m):
    """8.1."""
    h = xxhash.xxh3_128(struct.pack("<II", m.depth, m.limit))
    for t in (GRID, ATTRIBUTES, MATERIALS, LIGHTS, TEXTURE):
        if (t, 0) in m.section:
            h.update(stored(m, m.section[t, 0]))
    for level in range(1, m.depth + 1):
        for c in m.directories[level]:
            h.update(struct.pack("<BQ", c.depth, c.prefix))
        h.update(bytes(m.levels[level].masks))
    for values in m.levels[m.depth].values:
        h.update(bytes(values))
    return h.intdigest().to_bytes(16, "little")

def read(data, max_nodes=None):
    """Prove every rule of a file (8.3) and return its Model. `max_nodes` is the limit of 4.5."""
    m = Model()
    m.data, m.lights, m.texture = bytes(data), [], None
    read_header(m)
    read_table(m)
    check_padding(m)
    check_hashes(m, lambda t: t != CHUNKS)
    for t, parse in ((METADATA, read_metadata), (GRID, read_grid), (ATTRIBUTES, read_attributes),
                     (MATERIALS, read_materials), (LIGHTS, read_lights), (TEXTURE, read_texture)):
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
    need(content_id(m) == m.content_id, "bad_content", 72, "8.1")
    return m
