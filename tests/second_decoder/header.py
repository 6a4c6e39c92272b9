"""Header, section table, hashes of sections (sections 2, 3.1 and 3.2 of the specification)."""

import struct
from collections import namedtuple

import rasters
from streams import need, xxh3

MAGIC = b"\x89BVG\r\n\x1a\n"
METADATA, GRID, ATTRIBUTES, MATERIALS, LIGHTS, TEXTURE, GROUND, DIRECTORY, CHUNKS, BRICKS = 1, 2, 3, 4, 5, 6, 7, 16, 17, 18
FIELDS, FIELD_DIRECTORY, FIELD_VALUES = 8, 40, 41       # 17.1
SHAPES = 10                                             # 18.1
STREAM_DIRECTORY, STREAM_VALUES = 42, 43                # 19.1
RASTERS = (rasters.GROUND_TEXTURE, rasters.GROUND_LIT, rasters.PANORAMA)
PLACES = {DIRECTORY: 0, BRICKS: 1, CHUNKS: 2}           # 3.2.2: the sections of a level
EXPANSION = 32768                                       # section 10: raw bytes per stored byte

Entry = namedtuple("Entry", "type codec flags instance element alignment zero offset stored raw count hash at")

def stored(m, e):
    return m.data[e.offset:e.offset + e.stored]

def power_of_two(v, low, high):
    return low <= v <= high and v & (v - 1) == 0

def read_header(m):
    """Section 2, rules 2.1 to 2.13."""
    data = m.data
    need(data and data[:8] == MAGIC[:len(data)], "not_bvg", 0, "2.1")
    need(len(data) >= 128, "truncated", len(data), "2.2")
    (_, major, m.minor, tag, size, table, m.sections, m.depth, zero, required, m.optional, m.points, m.raw, m.content_id, m.root,
     m.limit, zero2, m.table_hash, hash64) = struct.unpack_from("<8sHHIQQIB3sQQQQ16s16sI4sQQ", data)
    need(hash64 == xxh3(data[:120]), "bad_hash", 0, "2.3")
    need(tag == 0x01020304, "bad_header", 12, "2.4")
    need(major == 1, "unsupported_version", 8, "2.5")
    need(required & ~1 == 0, "unsupported_feature", 40, "2.6")
    m.mapped = required == 1
    m.closed = m.optional & 2 != 0                      # 2.19
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
    levels = e.type in PLACES or e.type in (FIELD_DIRECTORY, FIELD_VALUES)
    of_points = e.type in (STREAM_DIRECTORY, STREAM_VALUES)
    coded = e.type in (CHUNKS, FIELD_VALUES, STREAM_VALUES) or e.type in RASTERS
    known = e.type in range(1, 9) or e.type == SHAPES or levels or of_points or e.type in RASTERS
    most = 7 if e.type == rasters.GROUND_LIT else 0
    rule(e.zero == 0, 20, "3.2.1")
    rule(before is None or key(before) < key(e), 0, "3.2.2")
    rule(known or not e.flags & 1, 0, "3.2.4", "unsupported_feature")
    rule(not known or e.codec == (coded and not m.mapped), 4, "3.2.5", "unsupported_feature")
    rule(e.flags & ~1 == 0, 6, "3.2.6")
    rule(e.type not in (FIELDS, FIELD_DIRECTORY, FIELD_VALUES) or not e.flags & 1, 6, "17.1.3")
    rule(e.type != SHAPES or not e.flags & 1, 6, "18.1.1")
    rule(not of_points or not e.flags & 1, 6, "19.1.1")
    kind = e.instance >> 8
    rule(not of_points or 1 <= kind <= 255 and 1 <= e.instance & 255 <= m.depth, 8, "3.2.7")
    rule(not known or of_points or (1 <= e.instance <= m.depth if levels else e.instance <= most), 8, "3.2.7")
    rule(power_of_two(e.alignment, 8, 65536), 16, "3.2.8")
    rule(e.codec != 0 or e.raw == e.stored, 40, "3.2.9")
    rule(e.raw < EXPANSION * (e.stored + 1), 40, "3.2.10", "too_large")
    if coded:
        rule(e.element == 0, 12, "3.2.13")
    elif known:
        rule(e.element > 0 and e.element * e.count == e.raw, 12, "3.2.13")
    rule(m.mapped or e.type != BRICKS, 0, "3.2.15")
    must = {CHUNKS: 4096, BRICKS: 64, **dict.fromkeys(RASTERS, 64)} if m.mapped else {}
    rule(e.alignment == must.get(e.type, e.alignment), 16, "3.2.16")
    rule(e.offset == -(-end // e.alignment) * e.alignment, 24, "3.2.3")
    need(e.offset + e.stored <= len(m.data), "truncated", len(m.data), "3.2.11")

def read_table(m):
    """3.1, 3.2 and the hashes of the raw sections (3.3). Sections are kept by (type, instance)."""
    need(1 <= m.sections <= 256, "bad_header", 32, "3.1.1")
    end = 128 + 64 * m.sections
    need(end <= len(m.data), "truncated", len(m.data), "3.1.2")
    need(m.table_hash == xxh3(m.data[128:end]), "bad_hash", 128, "3.1.3")
    m.entries, m.section, before, total = [], {}, None, 0
    for at in range(128, 128 + 64 * m.sections, 64):
        e = Entry(*struct.unpack_from("<IHHIIIIQQQQQ", m.data, at), at)
        check_entry(m, e, before, end)
        before, end, total = e, e.offset + e.stored, total + e.raw
        need(total < 2 ** 64, "bad_table", at + 40, "3.1.4")
        m.entries.append(e)
        m.section[e.type, e.instance] = e
    need(end == len(m.data), "bad_table", end, "3.1.5")
    need(total == m.raw, "bad_header", 64, "3.1.6")
    need(all((t, 0) in m.section for t in (METADATA, GRID, ATTRIBUTES, MATERIALS)), "bad_table", 128, "3.1.7")
    of_levels = (DIRECTORY, BRICKS, CHUNKS) if m.mapped else (DIRECTORY, CHUNKS)
    need(all((t, level) in m.section for t in of_levels for level in range(1, m.depth + 1)), "bad_table", 128, "3.1.8")
    of_fields = [(t, level) in m.section for t in (FIELD_DIRECTORY, FIELD_VALUES) for level in range(1, m.depth + 1)]
    need(set(of_fields) == {(FIELDS, 0) in m.section}, "bad_table", 128, "17.1.1")
    directories, values = ({i for t, i in m.section if t == of} for of in (STREAM_DIRECTORY, STREAM_VALUES))
    need(directories == values, "bad_table", 128, "19.1.2")

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
