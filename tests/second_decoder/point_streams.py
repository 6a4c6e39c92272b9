"""Optional streams of points, and the sides of thin walls (section 19 of the specification)."""

import struct
from collections import namedtuple

from header import EXPANSION, STREAM_DIRECTORY as DIRECTORY, STREAM_VALUES as VALUES, stored
from levels import raw_sizes
from streams import Part, fold_bits, need, unpack_part, xxh3
from values import MATERIAL, NORMAL, RADIUS, SHADOW

SIDES = 1                                               # kinds of point streams
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

def read_sides(m, level, c, part):
    """19.4: the points of a chunk that have sides, and the values of both sides of each, stream by stream."""
    data = unpack_part(m, part, part.offset)
    def rule(condition, number):
        need(condition, "bad_attribute", part.offset, number)
    size = (c.points + 7) // 8
    points = [i for i in range(8 * min(size, len(data))) if data[i >> 3] >> (i & 7) & 1]
    rule(len(data) >= size and points and points[-1] < c.points, "19.4.1")
    count = 2 * len(points)
    streams = [(s, raw) for s, raw in zip(m.streams, raw_sizes(m, level, 0, count)[1:]) if s.kind != RADIUS]
    rule(len(data) == size + sum(raw for _, raw in streams), "19.4.1")
    rule(c.cosine == -32767, "19.4.3")
    values, at = [], size
    for s, raw in streams:
        bytes_of = data[at:at + raw]
        if s.kind == NORMAL:
            rule(max(struct.unpack(f"<{count}H", bytes_of)) < 0x2000, "19.4.2")
        elif s.kind == MATERIAL:
            rule(max(bytes_of) < len(m.materials), "6.4.1")
        elif s.kind == SHADOW:
            bytes_of = fold_bits(part, bytes_of, s.bits[level], count)
        values.append(bytes_of)
        at += raw
    return points, values

def read(m):
    """m.sides[level]: the sides of the points of each level; None if it has none."""
    m.sides = [None] * (m.depth + 1)
    for level in range(1, m.depth + 1):
        if (DIRECTORY, 256 * SIDES + level) not in m.section:
            continue
        sides, first = Side([], [bytearray() for s in m.streams if s.kind != RADIUS]), 0
        for c, (digest, part) in zip(m.directories[level], read_directory(m, SIDES, level)):
            need(digest == xxh3(m.data[part.offset:part.offset + part.stored]), "bad_hash", part.offset, "19.3.1")
            if part.raw:
                points, values = read_sides(m, level, c, part)
                sides.points.extend(first + i for i in points)
                for column, more in zip(sides.values, values):
                    column += more
            first += c.points
        m.sides[level] = sides
