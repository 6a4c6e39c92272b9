"""Stored streams of a chunk, their filters and the ranks of masks (sections 5.6, 5.8 and 5.9 of the specification)."""

import functools
import itertools
import struct
from collections import namedtuple
from pathlib import Path

import xxhash
import zstandard

from values import (CELLS, COLOUR, MATERIAL, NORMAL, NORMAL_OF_CELL, NORMAL_SUMS, RADIUS, SHADOW, TEXEL, covering_radius,
                    elements, stream_bytes)

Part = namedtuple("Part", "offset stored raw filter zstd")      # one stream of a chunk in the file, or one plane of it
PLANES = {1: 1, 2: 2, 3: 1, 4: 3, 5: 3, 6: 1, 7: 1, 8: 1, 10: 2}       # 5.8: how many each filter has

class BvgError(Exception):
    """A broken rule: code of section 9, offset in the file, number of the rule."""

    def __init__(self, code, offset, rule):
        super().__init__(f"{code} at {offset}: rule {rule}")
        self.code, self.offset, self.rule = code, offset, rule

def need(condition, code, offset, rule):
    if not condition:
        raise BvgError(code, offset, rule)

def xxh3(data):
    return xxhash.xxh3_64_intdigest(data)

def filter_of(stream):
    """5.8: the filter that a stream may have; None stands for the masks."""
    if stream is None:
        return 1
    return {NORMAL: 2, RADIUS: 3, COLOUR: 3 + stream.format, MATERIAL: 6, TEXEL: 7, SHADOW: 8}[stream.kind]

def frame_content(data):
    """5.6.1: the content size of exactly one frame of RFC 8878, or None. Walks its header and the headers of its blocks."""
    if data[:4] != b"\x28\xb5\x2f\xfd" or len(data) < 5 or data[4] & 0x2B != 0x20:
        return None
    width = (1, 2, 4, 8)[data[4] >> 6]
    content, at, last = int.from_bytes(data[5:5 + width], "little") + (256 if width == 2 else 0), 5 + width, False
    while not last:
        if len(data) < at + 3:
            return None
        block = int.from_bytes(data[at:at + 3], "little")
        last, kind, size = block & 1, block >> 1 & 3, block >> 3
        if kind == 3:
            return None
        at += 3 + (1 if kind == 1 else size)
    return content if at + (4 if data[4] & 4 else 0) == len(data) else None

def unpack_part(m, part, stream):
    """5.6.1 to 5.6.3: the raw bytes of a stored stream, or of a plane of the stream that starts at the offset `stream`."""
    data = m.data[part.offset:part.offset + part.stored]
    if not part.zstd:
        return data
    content = frame_content(data)
    need(content is not None, "bad_attribute", stream, "5.6.1")
    need(content == part.raw, "bad_attribute", stream, "5.6.2")
    try:
        out = zstandard.ZstdDecompressor().decompress(data, max_output_size=part.raw)
    except zstandard.ZstdError:
        raise BvgError("bad_attribute", stream, "5.6.3") from None
    need(len(out) == part.raw, "bad_attribute", stream, "5.6.3")
    return out

def fold_bits(part, data, bits, count):
    """6.6: the lit fractions (or their codes) of packed bytes, one byte each; bits after the last are zero."""
    need(data[-1] >> 8 - (8 * len(data) - bits * count) == 0, "bad_attribute", part.offset, "6.6.1")
    return bytes(data[i * bits >> 3] >> (i * bits & 7) & (1 << bits) - 1 for i in range(count))

# ---- 5.8: filters

class Planes:
    """The planes of a filtered stream (5.8.1), taken in their order. `take` verifies that they are as large as announced."""

    def __init__(self, m, part, count=None):
        self.m, self.part, self.number = m, part, 0
        self.words = struct.unpack_from(f"<{count or PLANES[part.filter]}I", m.data, part.offset)
        self.offset, self.last = part.offset + 4 * len(self.words), part.offset + part.stored
        self.need(not any(word & 0x7F000000 for word in self.words), "5.8.1")

    def need(self, condition, rule):
        need(condition, "bad_attribute", self.part.offset, rule)

    def take(self, raw):
        """The next plane, which has `raw` bytes."""
        word, offset = self.words[self.number], self.offset
        size, zstd = word & 0xFFFFFF, word >> 31
        self.need(size < raw if zstd else size == raw, "5.8.1")
        self.number, self.offset = self.number + 1, offset + size
        self.need(self.offset <= self.last, "5.8.1")
        out = unpack_part(self.m, Part(offset, size, raw, 0, zstd), self.part.offset)
        self.need(self.offset == self.last or self.number < len(self.words), "5.8.1")
        return out

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
    modulus, green_modulus = (32, 64) if form == 1 else (256, 256)
    greens = planes.take(len(parents))
    out = []
    for (r, g, b), code, (red, blue, _) in zip(parents, greens, planes.pairs(len(parents))):
        step = unfold(code)
        h = int(step / 2) if form == 1 else step
        out.append(((r + h + unfold(red)) % modulus, (g + step) % green_modulus, (b + h + unfold(blue)) % modulus))
    return out

@functools.lru_cache(maxsize=None)
def predicted_radius(level, finest, parent):
    """5.8.4: the p of a parent's radius."""
    return max((i for i in range(204 if level == finest else 256) if covering_radius(level - 1, i) <= parent), default=0)

def unfilter_lit(level, stream, planes, parents):
    """5.8.8."""
    full, above = 2 ** stream.bits[level] - 1, 2 ** stream.bits[level - 1] - 1
    data = planes.take((stream.bits[level] * len(parents) + 7) // 8)
    codes = fold_bits(planes.part, data, stream.bits[level], len(parents))
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

def unfilter(level, finest, stream, planes, parents, counts):
    """5.8: an attribute stream's bytes, lit fractions one byte each, from those of the parent nodes; `counts` are the
    parents' numbers of children, `finest` is the depth."""
    if stream.kind in (RADIUS, SHADOW):
        each = [parent for parent, count in zip(parents, counts) for _ in range(count)]
        if stream.kind == SHADOW:
            return unfilter_lit(level, stream, planes, each)
        return bytes(predicted_radius(level, finest, parent) - code & 255 for parent, code in zip(each, planes.take(len(each))))
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
