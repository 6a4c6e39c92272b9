"""Optional streams of points: the sides of thin walls, and surface offsets (section 19 of the specification)."""

import struct
from collections import namedtuple

from header import EXPANSION, STREAM_DIRECTORY as DIRECTORY, STREAM_VALUES as VALUES, stored
from levels import raw_sizes
from streams import Part, fold_bits, need, unpack_part, xxh3
from values import MATERIAL, NORMAL, RADIUS, SHADOW

SIDES, OFFSETS = 1, 3                                   # kinds of point streams
Side = namedtuple("Side", "points values")              # of a level: indices, and the bytes of each stream but radii

def read_directory(m, kind, level):
    """19.2: hash and part of each chunk."""
    e, section = (m.section[t, 256 * kind + level] for t in (DIRECTORY, VALUES))
    chunks = m.directories[level]
    need(e.hash == xxh3(stored(m, e)), "bad_hash", e.offset, "3.2.14")
    need(e.raw == 16 * len(chunks), "bad_directory", e.offset, "19.2.1")
    parts, at, offset = [], e.offset, section.offset
    for c in chunks:
        digest, word, raw = struct.unpack_from("<QII", m.data, at)
        size, zstd = word & 0xFFFFFF, word >> 31
        need(word >> 24 & 127 == 0, "unsupported_feature", at + 8, "19.2.2")
        possible = 1 <= size < raw if zstd else size == raw
        need(possible and raw <= 32 * c.points and not (m.mapped and zstd), "bad_directory", at + 8, "19.2.3")
        need(raw < EXPANSION * (size + 1), "too_large", at + 8, "19.2.4")
        parts.append((digest, Part(offset, size, raw, 0, zstd)))
        at, offset = at + 16, offset + size
    sums = (offset - section.offset, sum(p.raw for _, p in parts), sum(c.points for c in chunks))
    need(sums == (section.stored, section.raw, section.count), "bad_directory", at, "19.2.5")
    return parts

def rule(part, condition, number):
    need(condition, "bad_attribute", part.offset, number)

def read_mask(c, part, data, number):
    """The size of the mask, and the points of the chunk that it marks."""
    size = (c.points + 7) // 8
    points = [i for i in range(8 * min(size, len(data))) if data[i >> 3] >> (i & 7) & 1]
    rule(part, len(data) >= size and points and points[-1] < c.points, number)
    return size, points

def read_offsets(m, level, c, part):
    """19.6: the points of a chunk that have offsets, and these."""
    data = unpack_part(m, part, part.offset)
    size, points = read_mask(c, part, data, "19.6.1")
    rule(part, len(data) == size + len(points), "19.6.1")
    offsets = data[size:]
    rule(part, all(offset <= 14 or offset >= 256 - 14 for offset in offsets), "19.6.2")
    return points, [offsets]

def read_sides(m, level, c, part):
    """19.4: the points of a chunk that have sides, and the values of both sides of each, stream by stream."""
    data = unpack_part(m, part, part.offset)
    size, points = read_mask(c, part, data, "19.4.1")
    count = 2 * len(points)
    streams = [(s, raw) for s, raw in zip(m.streams, raw_sizes(m, level, 0, count)[1:]) if s.kind != RADIUS]
    rule(part, len(data) == size + sum(raw for _, raw in streams), "19.4.1")
    rule(part, c.cosine == -32767, "19.4.3")
    values, at = [], size
    for s, raw in streams:
        bytes_of = data[at:at + raw]
        if s.kind == NORMAL:
            rule(part, max(struct.unpack(f"<{count}H", bytes_of)) < 0x2000, "19.4.2")
        elif s.kind == MATERIAL:
            rule(part, max(bytes_of) < len(m.materials), "6.4.1")
        elif s.kind == SHADOW:
            bytes_of = fold_bits(part, bytes_of, s.bits[level], count)
        values.append(bytes_of)
        at += raw
    return points, values

def read_stream(m, kind, level, columns, read_chunk):
    """The points of a level that a kind of stream says something of, and its columns of values; None if there is none."""
    if (DIRECTORY, 256 * kind + level) not in m.section:
        return None
    all_points, first = Side([], [bytearray() for _ in range(columns)]), 0
    for c, (digest, part) in zip(m.directories[level], read_directory(m, kind, level)):
        need(digest == xxh3(m.data[part.offset:part.offset + part.stored]), "bad_hash", part.offset, "19.3.1")
        if part.raw:
            points, values = read_chunk(m, level, c, part)
            all_points.points.extend(first + i for i in points)
            for column, more in zip(all_points.values, values):
                column += more
        first += c.points
    return all_points

def read(m):
    """m.sides[level], m.offsets[level]: of the points of each level; None if it has none."""
    levels, columns = range(1, m.depth + 1), sum(s.kind != RADIUS for s in m.streams)
    m.sides = [None, *(read_stream(m, SIDES, level, columns, read_sides) for level in levels)]
    m.offsets = [None, *(read_stream(m, OFFSETS, level, 1, read_offsets) for level in levels)]
