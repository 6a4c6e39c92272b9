#!/usr/bin/python3
"""A second decoder and validator of .pbvg files, written from the text of the specification alone: bvg.py FILE...

Numbers in brackets are paragraphs of the specification. `read(data)` verifies every rule and returns a Model; the first
broken rule raises BvgError with the code of section 9, an offset in the file and the rule.
Needs the Debian packages python3-zstandard and python3-xxhash; 100,000 points take about five seconds.
"""

import struct
import sys
from pathlib import Path

import xxhash

import fields
import point_streams
import rasters
from averages import Sums, root_record
from header import (ATTRIBUTES, CHUNKS, DIRECTORY, GRID, GROUND, LIGHTS, MATERIALS, METADATA, RASTERS, SHAPES, TEXTURE, check_hashes,
                    check_padding, read_header, read_table, stored)
from levels import check_chunk_rule, child_starts, level_0, read_directory, read_level
from parameters import (check_together, read_attributes, read_grid, read_ground, read_lights, read_materials, read_metadata,
                        read_shapes, read_texture)
from streams import BvgError, need
from values import COLOUR, MATERIAL, NORMAL, RADIUS, SHADOW, TEXEL

SMALL_SECTIONS = (METADATA, GRID, ATTRIBUTES, MATERIALS, LIGHTS, TEXTURE, GROUND, fields.FIELDS, SHAPES)

class Model:
    """What a file holds: header fields, sections, streams, directories and levels."""

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
    for e, (width, height, texels, _) in m.rasters:
        h.update(struct.pack("<4I", e.type, e.instance, width, height) + texels)
    return h.intdigest().to_bytes(16, "little")

def read(data, max_nodes=None, validates=True):
    """Verify every rule of a file (8.3), or only those that a reader verifies (8.2), and return its Model. `max_nodes` is
    the limit of 4.5."""
    m = Model()
    m.data, m.lights, m.texture, m.ground, m.fields, m.shapes, m.tints = bytes(data), [], None, None, [], [], []
    m.validates = validates
    read_header(m)
    read_table(m)
    if validates:
        check_padding(m)
    check_hashes(m, lambda t: t in (*SMALL_SECTIONS, DIRECTORY, fields.DIRECTORY) or validates and t != CHUNKS)
    for t, parse in ((METADATA, read_metadata), (GRID, read_grid), (ATTRIBUTES, read_attributes),
                     (MATERIALS, read_materials), (LIGHTS, read_lights), (TEXTURE, read_texture), (GROUND, read_ground),
                     (fields.FIELDS, fields.read_section), (SHAPES, read_shapes)):
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
    if validates:
        for level in range(1, m.depth + 1):
            check_chunk_rule(m, level)
        check_hashes(m, lambda t: t == CHUNKS)
    m.rasters = [(e, rasters.read(m, e)) for e in m.entries if e.type in RASTERS]
    fields.read_values(m)
    point_streams.read(m)
    if validates:
        check_whole(m)
    return m

def check_whole(m):
    """7.1 and 8.1."""
    check_averages(m)
    if content_id(m) != m.content_id:
        error = BvgError("bad_content", 72, "8.1")
        error.model = m
        raise error
    fields.check_whole(m)

def summary(m):
    """What a valid file holds, as lines of text."""
    names = {NORMAL: "normal", RADIUS: "radius", COLOUR: "colour", MATERIAL: "material", TEXEL: "texture value", SHADOW: "shadow"}
    yield f"  version 1.{m.minor}, {m.points:,} points at depth {m.depth}, {'mapped' if m.mapped else 'packed'}{', closed' if m.closed else ''}, {len(m.data):,} bytes, {m.raw:,} raw"
    yield f"  content_id {m.content_id.hex()}"
    yield f"  grid: corner ({', '.join(f'{c:g}' for c in m.corner)}), voxel size {m.voxel:g}"
    yield "  attributes: " + ", ".join(names[s.kind] + {0: "", 1: " 565", 2: " 888"}[s.format] for s in m.streams)
    yield f"  {len(m.materials)} materials, {len(m.lights)} lights, " + ("a ground plane" if m.ground else "no ground plane")
    if any(m.shapes):
        yield "  materials of round points: " + " ".join(str(i) for i, shape in enumerate(m.shapes) if shape)
    if any(m.tints):
        yield "  tints of reflections: " + " ".join(map(str, m.tints))
    for f in m.fields:
        yield f"  field {f.name!r}: {f.offset:g} + {f.scale:g} x (stored - 1) {f.unit}, {f.bytes} bytes, average {f.average}"
    for level, chunks in enumerate(m.directories[1:], 1):
        yield f"  level {level}: {len(m.levels[level].codes):,} points in {len(chunks):,} chunks"
    for level, sides in enumerate(m.sides):
        if sides:
            yield f"  level {level}: {len(sides.points):,} points with two sides"
    for level, offsets in enumerate(m.offsets):
        if offsets:
            yield f"  level {level}: {len(offsets.points):,} points with offsets"
    for e, (width, height, *_) in m.rasters:
        yield f"  raster {e.type}, {e.instance}: {width} x {height}"

def main(paths):
    """Verdict and summary of each file; exit code 1 if one is not valid."""
    code = 0
    for path in paths:
        try:
            m = read(Path(path).read_bytes())
            print(f"VALID {path}", *summary(m), sep="\n")
        except BvgError as error:
            print(f"INVALID {path}: {error}")
            code = 1
    return code

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]) if len(sys.argv) > 1 else __doc__)
