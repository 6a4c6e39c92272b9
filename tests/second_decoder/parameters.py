"""Metadata, grid, attributes, materials, lights, texture, ground plane (sections 3.3 to 3.9 and 3.11 of the specification)."""

import json
import math
import struct

import rasters
from header import ATTRIBUTES, CHUNKS, stored
from streams import BvgError, need
from values import COLOUR, MATERIAL, NORMAL, RADIUS, SHADOW, TEXEL, Stream, expand565, pack565

def f32(v):
    """The binary32 nearest to a value (1.6): of a bound in the text, or of one sum or product of binary32."""
    try:
        return struct.unpack("<f", struct.pack("<f", v))[0]
    except OverflowError:
        return math.copysign(math.inf, v)

class Object(list):
    """A JSON object as its pairs, so that a key which stands twice hides nothing."""

def strings_and_depth(value):
    """All strings of a JSON value, keys too, and how deep its objects and arrays are nested."""
    strings, deepest, todo = [], 0, [(value, 1)]
    while todo:
        v, depth = todo.pop()
        if isinstance(v, str):
            strings.append(v)
        if isinstance(v, list):
            deepest = max(deepest, depth)
            inner = [part for pair in v for part in pair] if isinstance(v, Object) else v
            todo += [(part, depth + 1) for part in inner]
    return strings, deepest

def parse_json(text):
    """RFC 8259: neither NaN and infinities, nor numbers that round to them, nor halves of surrogate pairs."""
    def refuse(name):
        raise ValueError(name)
    def number(digits):
        return float(digits) if math.isfinite(float(digits)) else refuse(digits)
    value = json.loads(text, parse_constant=refuse, parse_float=number, parse_int=number, object_pairs_hook=Object)
    strings, depth = strings_and_depth(value)
    "".join(strings).encode("utf-8")
    if depth > 32:
        refuse("depth")
    return value

def read_metadata(m, e):
    """3.3: one JSON object in at most 4,096 bytes of UTF-8."""
    need(e.stored <= 4096, "bad_section", e.offset, "3.3.1")
    try:
        m.metadata = parse_json(stored(m, e).decode("utf-8"))
    except (ValueError, RecursionError):
        raise BvgError("bad_section", e.offset, "3.3.2") from None
    need(isinstance(m.metadata, Object), "bad_section", e.offset, "3.3.3")

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

def read_shapes(m, e):
    """18.2: a shape that is not known is that of a disc."""
    need(e.raw == 8 * len(m.materials), "bad_section", e.offset, "18.2.1")
    m.tints = list(m.data[e.offset + 1:e.offset + e.raw:8])
    m.shapes = [int(shape == 1) for shape in m.data[e.offset:e.offset + e.raw:8]]

def read_lights(m, e):
    """3.7."""
    for at, record in records(m, e, 48, "3.7.1"):
        kind, zero, *v, spot, zero2 = struct.unpack("<B3s10f4s", record)
        need(kind <= 2, "bad_section", at, "3.7.2")
        need(all(0 <= i <= 1e6 for i in v[:3]), "bad_section", at + 4, "3.7.3")
        need(all(map(math.isfinite, v[3:6])), "bad_section", at + 16, "3.7.4")
        x, y, z = (f32(c * c) for c in v[6:9])
        need(f32(0.998) <= f32(f32(x + y) + z) <= f32(1.002), "bad_section", at + 28, "3.7.5")
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
    """3.9, and 2.14 to 2.18: header and root record fit the sections."""
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
    need(m.section[CHUNKS, m.depth].count == m.points, "bad_header", 56, "2.18")
