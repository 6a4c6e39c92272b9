"""Bricks of mapped files (sections 5.10.2 and 5.11 of the specification)."""

import itertools
import struct
from collections import namedtuple

from streams import need
from values import INTEGER_NORMALS, dot, holding_triangle

SIZE = 24
NO_CONE = (0, -32767)

Brick = namedtuple("Brick", "x y z point node axis cosine radius flags map")
LAYOUT = struct.Struct("<6HhBBQ")
FIELDS = ((0, "5.11.2", ("x", "y", "z")), (6, "5.11.2", ("point", "node")), (16, "5.11.2", ("map",)),
          (10, "5.11.3", ("axis", "cosine")), (14, "5.11.4", ("radius", "flags")))      # what section 9 takes as one field

def check_section(e, chunks):
    """5.10.2: the bricks section of a level and the chunks of its directory."""
    need((e.element, e.count) == (SIZE, sum(c.bricks for c in chunks)), "bad_directory", e.offset, "5.10.2")

def coordinates(code):
    """1.5: x, y, z of a Morton code."""
    return tuple(sum((code >> 3 * i + k & 1) << i for i in range(16)) for k in range(3))

def cone(normals):
    """5.11.3: axis and cosine for the stored normals of a brick's points."""
    if any(n & 0x2000 for n in normals):
        return NO_CONE
    integers = [INTEGER_NORMALS[n & 8191] for n in normals]
    axis = holding_triangle(tuple(map(sum, zip(*integers))))
    cosine = min(32767, min(dot(INTEGER_NORMALS[axis], n) for n in set(integers)) // 32767)
    return (axis, cosine) if cosine > -32767 else NO_CONE

def check_whole(c, level, codes, node):
    """5.11.1: a chunk has whole bricks below its root. `codes` are those of level - 1; the chunk's start at `node`."""
    last = node + c.nodes - 1
    inside = all(code >> 3 * (level - 1 - c.depth) == c.prefix for code in codes[node:last + 1])
    split = [i for i in (node, last + 1) if 0 < i < len(codes) and codes[i - 1] >> 6 == codes[i] >> 6]
    bricks = len({code >> 6 for code in codes[node:last + 1]})
    need(inside and not split and bricks == c.bricks, "bad_directory", c.offset, "5.11.1")

def check_chunk(m, level, c, codes, node, counts, normals, radii, at):
    """5.11 for a chunk, whose records start at the offset `at`; `counts` are the numbers of children of its nodes."""
    check_whole(c, level, codes, node)
    stored_normals = struct.unpack(f"<{c.points}H", normals)
    first, point = 0, 0
    for brick, group in itertools.groupby(codes[node:node + c.nodes], lambda code: code >> 6):
        places = [code & 63 for code in group]
        after = point + sum(counts[first:first + len(places)])
        mine = stored_normals[point:after]
        right = Brick(*coordinates(brick), point, first, *cone(mine), max(radii[point:after]), int(any(n & 0x2000 for n in mine)),
                      sum(1 << place for place in places))
        record = Brick(*LAYOUT.unpack_from(m.data, at))
        for field, rule, names in FIELDS:
            same = all(getattr(record, name) == getattr(right, name) for name in names)
            need(same, "bad_content", at + field, rule)
        first, point, at = first + len(places), after, at + SIZE
