"""Rasters: tiles, mip levels, their filter (sections 3.10 and 5.8.9 of the specification)."""

import struct

from streams import BvgError, Part, Planes, need, unfold, unpack_part, xxh3
from values import LINEAR, from_linear

GROUND_TEXTURE, GROUND_LIT, PANORAMA = 24, 25, 32
TILE = 64

class Raster:
    """Header and directory of a raster: its tiles, level by level, each (x, y, width, height, part, hash)."""

def power_of_two(v):
    return v > 0 and v & (v - 1) == 0

def tile_places(width, height):
    """The tiles of all levels in the order of the file: level, column, row, width and height in texels."""
    places = []
    for level in reversed(range(height.bit_length())):
        w, h = width >> level, height >> level
        tw, th = min(TILE, w), min(TILE, h)
        places += [(level, x, y, tw, th) for y in range(0, h, th) for x in range(0, w, tw)]
    return places

def read_header(m, e):
    """3.10.1 to 3.10.7, and 3.10.15 and 3.10.16 as far as they need no tile."""
    def rule(condition, field, number, code="bad_image"):
        need(condition, code, e.offset + field, number)
    r = Raster()
    rule(e.stored >= 32, 0, "3.10.1")
    hash64, r.width, r.height, count, r.alignment, r.channels, zero = struct.unpack_from("<QIIIHB9s", m.data, e.offset)
    r.directory_bytes = 32 + 16 * count
    rule(r.directory_bytes <= e.stored, 16, "3.10.2")
    rule(hash64 == xxh3(m.data[e.offset + 8:e.offset + r.directory_bytes]), 0, "3.10.3", "bad_hash")
    rule(power_of_two(r.width) and power_of_two(r.height) and r.height <= r.width <= 2 * r.height and
         r.width <= 16384 and r.channels in (1, 3), 8, "3.10.4")
    rule(r.alignment in (1, 64), 20, "3.10.5")
    rule(not any(zero), 23, "3.10.6")
    r.places = tile_places(r.width, r.height)
    rule(count == len(r.places), 16, "3.10.7")
    return r

def read_directory(m, e):
    """3.10.1 to 3.10.11, 3.10.15, 3.10.16: where the tiles of a raster lie."""
    r = read_header(m, e)
    def align(offset):
        return e.offset + -(-(offset - e.offset) // r.alignment) * r.alignment
    r.tiles, offset = [], e.offset + r.directory_bytes
    for number, (_, _, _, w, h) in enumerate(r.places):
        at = e.offset + 32 + 16 * number
        hash64, word, zero = struct.unpack_from("<QII", m.data, at)
        need(zero == 0, "bad_image", at + 12, "3.10.8")
        size, filter_id, zstd, raw = word & 0xFFFFFF, word >> 24 & 127, word >> 31, w * h * r.channels
        need(filter_id in (0, 9), "unsupported_feature", at + 8, "3.10.9")
        if filter_id:
            need(not zstd and 4 * r.channels <= size < raw, "bad_image", at + 8, "3.10.10")
        else:
            need(1 <= size < raw if zstd else size == raw, "bad_image", at + 8, "3.10.10")
        need(not m.mapped or not (filter_id or zstd), "bad_image", at + 8, "3.10.10")
        offset = align(offset)
        need(offset + size <= e.offset + e.stored, "bad_image", at + 8, "3.10.11")
        r.tiles.append((Part(offset, size, raw, filter_id, zstd), hash64))
        offset += size
    need(align(offset) == e.offset + e.stored, "bad_image", offset, "3.10.11")
    need(r.alignment == (64 if m.mapped else 1), "bad_image", e.offset + 20, "3.10.5")
    panorama = r.channels == 3 and r.width == 2 * r.height
    ground = r.channels == 1 and r.width == r.height <= 4096
    need(panorama if e.type == PANORAMA else ground, "bad_image", e.offset + 8, "3.10.15")
    raw_bytes = r.directory_bytes + sum(part.raw for part, _ in r.tiles)
    need((e.count, e.raw) == (len(r.tiles), e.stored if m.mapped else raw_bytes), "bad_image", e.offset, "3.10.16")
    return r

def unfilter(planes, texels, width, channels):
    """5.8.9: the `texels` of a filtered tile, rows of `width`."""
    out = []
    for _ in range(channels):
        plane = []
        for i, code in enumerate(planes.take(texels)):
            before = 0 if i == 0 else plane[i - 1 if i % width else i - width]
            plane.append((before + unfold(code)) % 256)
        out.append(plane)
    if channels == 1:
        return bytes(out[0])
    return bytes(v for g, r, b in zip(*out) for v in ((r + g) % 256, g, (b + g) % 256))

def mean_of_four(texels, width, channels):
    """3.10.14: the next mip level."""
    back = from_linear if channels == 3 else int
    value = [LINEAR[v] if channels == 3 else v for v in texels]
    row, out = width * channels, bytearray()
    for y in range(0, len(texels), 2 * row):
        for x in range(y, y + row, 2 * channels):
            for i in range(x, x + channels):
                out.append(back((value[i] + value[i + channels] + value[i + row] + value[i + row + channels] + 2) // 4))
    return bytes(out)

def read(m, e):
    """Verifies a raster and returns its shape, the texels of mip level 0 and its tiles."""
    r = read_directory(m, e)
    levels = [bytearray((r.width >> k) * (r.height >> k) * r.channels) for k in range(r.height.bit_length())]
    end = e.offset + r.directory_bytes
    for (level, x, y, w, h), (part, hash64) in zip(r.places, r.tiles):
        padding(m, end, part.offset)
        end = part.offset + part.stored
        need(hash64 == xxh3(m.data[part.offset:end]), "bad_hash", part.offset, "3.10.12")
        if part.filter:
            texels = unfilter(Planes(m, part, r.channels), w * h, w, r.channels)
        else:
            texels = unpack_part(m, part, part.offset)
        for row in range(h):
            at = ((y + row) * (r.width >> level) + x) * r.channels
            levels[level][at:at + w * r.channels] = texels[row * w * r.channels:(row + 1) * w * r.channels]
    padding(m, end, e.offset + e.stored)
    for level in range(1, len(levels) if m.validates else 1):
        expected = mean_of_four(levels[level - 1], r.width >> level - 1, r.channels)
        need(expected == levels[level], "bad_content", e.offset, "3.10.14")
    return r.width, r.height, bytes(levels[0]), r.tiles

def padding(m, first, end):
    """3.10.13."""
    bad = next((i for i in range(first, end) if m.data[i]), None)
    if bad is not None and m.validates:
        raise BvgError("bad_image", bad, "3.10.13")
