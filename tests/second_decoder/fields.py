"""Fields of points (section 17 of the specification)."""

import struct
from collections import Counter, namedtuple

import xxhash

from header import EXPANSION, FIELD_DIRECTORY as DIRECTORY, FIELD_VALUES as VALUES, FIELDS, stored
from streams import PLANES, Part, Planes, need, siblings_of, unfold, unpack_part, with_only_children, xxh3

Field = namedtuple("Field", "name unit offset scale bytes average root")
RECORD = 96
MEAN, MAJORITY, MAXIMUM = 0, 1, 2

def text(data):
    """17.2.2: a text that zeros fill up; None: it is none."""
    content = data.split(b"\0")[0]
    try:
        decoded = content.decode("utf-8")
    except UnicodeDecodeError:
        return None
    controls = any(ord(c) < 0x20 or 0x7F <= ord(c) < 0xA0 for c in decoded)
    return None if controls or any(data[len(content):]) else decoded

def read_section(m, e):
    """17.1.2 and 17.2."""
    data = stored(m, e)
    count = (len(data) - 16) // RECORD
    need(1 <= count <= 8 and len(data) == 16 + RECORD * count, "bad_section", e.offset, "17.2.1")
    m.fields_id = data[:16]
    for at in range(16, len(data), RECORD):
        def rule(condition, field, number, code="bad_section"):
            need(condition, code, e.offset + at + field, number)
        name, unit, offset, scale, size, average, root, zero = struct.unpack_from("<32s16sddBBH28s", data, at)
        name, unit = text(name), text(unit)
        rule(name, 0, "17.2.2")
        rule(unit is not None, 32, "17.2.2")
        rule(name not in (f.name for f in m.fields), 0, "17.2.2")
        rule(size in (1, 2), 64, "17.2.4", "unsupported_feature")
        rule(average in (MEAN, MAJORITY, MAXIMUM), 65, "17.2.4", "unsupported_feature")
        finite = all(abs(v) < float("inf") for v in (offset, scale, offset + scale * (256 ** size - 2)))
        rule(finite and scale >= 2.0 ** -1022, 48, "17.2.3")
        rule(root < 256 ** size, 66, "17.2.5")
        rule(not any(zero), 68, "17.2.6")
        m.fields.append(Field(name, unit, offset, scale, size, average, root))
    if m.validates:
        need(m.optional & 1, "bad_table", 48, "17.1.2")

def read_directory(m, level):
    """17.4: the parts of a level, chunk by chunk, field by field."""
    e, section, chunks = m.section[DIRECTORY, level], m.section[VALUES, level], m.directories[level]
    need(e.raw == 12 * len(chunks) * len(m.fields), "bad_directory", e.offset, "17.4.1")
    parts, at, offset = [], e.offset, section.offset
    for c in chunks:
        for f in m.fields:
            digest, word = struct.unpack_from("<QI", m.data, at)
            size, filter_id, zstd, raw = word & 0xFFFFFF, word >> 24 & 127, word >> 31, f.bytes * c.points
            need(filter_id in (0, 7 if f.bytes == 1 else 10), "unsupported_feature", at + 8, "17.4.2")
            if filter_id:
                possible = not zstd and 4 * PLANES[filter_id] <= size < raw
            else:
                possible = 1 <= size < raw if zstd else size == raw
            need(possible and not (m.mapped and (filter_id or zstd)), "bad_directory", at + 8, "17.4.3")
            need(raw < EXPANSION * (size + 1), "too_large", at + 8, "17.4.4")
            parts.append((digest, Part(offset, size, raw, filter_id, zstd)))
            at, offset = at + 12, offset + size
    sums = (offset - section.offset, sum(p.raw for _, p in parts), sum(c.points for c in chunks))
    need(sums == (section.stored, section.raw, section.count), "bad_directory", at, "17.4.5")
    return parts

def unfilter(planes, size, nodes, counts):
    """17.5: the stored values, of `size` bytes, of a chunk's points from those of its nodes."""
    each = siblings_of(nodes, counts)
    codes = planes.take(len(each))
    if size == 2:
        codes = [low + 256 * high for low, high in zip(codes, planes.take(len(each)))]
    values = [(parent + unfold(code)) % 256 ** size for parent, code in zip(each, codes)]
    return with_only_children(values, nodes, counts)

def read_values(m):
    """17.4 and 17.5: m.values[level][field], the stored values as numbers."""
    m.values = [[[f.root] for f in m.fields]]
    for level in range(1, m.depth + 1 if m.fields else 1):
        parts, node, mask = iter(read_directory(m, level)), 0, m.levels[level].masks
        m.values.append([[] for _ in m.fields])
        for c in m.directories[level]:
            counts = [bin(k).count("1") for k in mask[node:node + c.nodes]]
            for f, values, above in zip(m.fields, m.values[level], m.values[level - 1]):
                digest, part = next(parts)
                need(digest == xxh3(m.data[part.offset:part.offset + part.stored]), "bad_hash", part.offset, "17.5.1")
                if part.filter:
                    values += unfilter(Planes(m, part), f.bytes, above[node:node + c.nodes], counts)
                else:
                    data = unpack_part(m, part, part.offset)
                    values += struct.unpack(f"<{c.points}{'BH'[f.bytes - 1]}", data)
            node += c.nodes

def average(kind, values):
    """17.3."""
    values = [v for v in values if v]
    if not values:
        return 0
    if kind == MEAN:
        return (2 * sum(values) + len(values)) // (2 * len(values))
    if kind == MAXIMUM:
        return max(values)
    votes = Counter(values)
    return min(v for v in votes if votes[v] == max(votes.values()))

def check_whole(m):
    """17.3.1 and 17.6.1."""
    if not m.fields:
        return
    raw = b"".join(struct.pack(f"<{len(v)}{'BH'[f.bytes - 1]}", *v) for f, v in zip(m.fields, m.values[m.depth]))
    section = m.section[FIELDS, 0]
    digest = xxhash.xxh3_128_intdigest(stored(m, section)[16:] + raw).to_bytes(16, "little")
    need(digest == m.fields_id, "bad_content", section.offset, "17.6.1")
    first = None                                        # of each node of the level, its first point of level d; the end
    for level in reversed(range(m.depth)):
        starts = m.starts[level]
        first = starts if first is None else [first[i] for i in starts]
        at = m.section[VALUES, level].offset if level else section.offset
        for f, values, finest in zip(m.fields, m.values[level], m.values[m.depth]):
            means = [average(f.average, finest[a:b]) for a, b in zip(first, first[1:])]
            need(means == values, "bad_content", at, "17.3.1")
