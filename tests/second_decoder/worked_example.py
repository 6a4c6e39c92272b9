"""The worked example of the specification, appendix D, as blocks of text: worked_example.py FILE

A chunk and its parent chunk: where the chunk's nodes lie, what its bytes mean, and how normals and colours come out of the
planes of their filters.
"""

import struct
import sys
from pathlib import Path

import bvg
from filters import KeptPlanes
from header import CHUNKS
from listing import CHUNK, Listing
from streams import unfold
from values import CELLS, COLOUR, NORMAL, NORMAL_OF_CELL

LEVEL, NUMBER = 5, 5                                    # the chunk
NAMES = ("masks", "normal", "radius", "colour")
FRAME = ((4, "radius: zstd frame, magic number"), (1, "descriptor: single segment, 1 byte of content size, no checksum"),
         (1, "content size {}", "B"), (3, "header of the last block: compressed, 7 bytes"), (7, "the block"))

class Example:
    """The chunk, its parent chunk, and the numbers of their first points, nodes and parents in their levels."""

    def __init__(self, m):
        self.m, self.chunk = m, m.directories[LEVEL][NUMBER]
        self.above, self.first = m.directories[LEVEL - 1][self.chunk.parent], {}
        for level, number in ((LEVEL - 1, self.chunk.parent), (LEVEL, NUMBER)):
            before = m.directories[level][:number]
            self.first[level] = [sum(getattr(c, name) for c in before) for name in ("points", "nodes", "parents")]
        self.node, self.parent = self.first[LEVEL][1], self.first[LEVEL][2]

    def values(self, level, kind, first, count):
        """The values of `count` points of a level."""
        stream = self.m.index[kind, 0]
        size = {NORMAL: 2, COLOUR: 3}[kind]
        data = bytes(self.m.levels[level].values[stream][size * first:size * (first + count)])
        return struct.unpack(f"<{count}H", data) if kind == NORMAL else [tuple(data[i:i + 3]) for i in range(0, len(data), 3)]

    def planes(self, kind):
        """The raw planes of one of the chunk's filtered streams."""
        planes = KeptPlanes(self.m, self.chunk.parts[1 + self.m.index[kind, 0]])
        siblings = sum(count for count in self.counts() if count > 1)
        if kind == COLOUR:
            planes.take(siblings)
        planes.pairs(siblings)
        return planes.kept

    def masks(self):
        return self.m.levels[LEVEL].masks[self.node:self.node + self.chunk.nodes]

    def counts(self):
        return [bin(mask).count("1") for mask in self.masks()]

    def points(self):
        """Node and child of each point."""
        return [(node, child) for node, mask in enumerate(self.masks()) for child in range(8) if mask >> child & 1]

def place(code):
    return tuple(sum((code >> 3 * i + k & 1) << i for i in range(16)) for k in range(3))

def chunks_block(e):
    """Which points and masks of the parent chunk are the chunk's nodes and parents."""
    yield "level chunk  parent chunk  points nodes parents  first point  first node  first parent"
    for level, number, c in ((LEVEL - 1, e.chunk.parent, e.above), (LEVEL, NUMBER, e.chunk)):
        yield "{:5} {:5} {:13} {:7} {:5} {:7} {:12} {:11} {:13}".format(level, number, c.parent, c.points, c.nodes, c.parents,
                                                                         *e.first[level])
    point, mask = e.node - e.first[LEVEL - 1][0], e.parent - e.first[LEVEL - 1][1]
    yield ""
    yield f"node i of the chunk   = point {e.node} - {e.first[LEVEL - 1][0]} + i = point {point} + i of its parent chunk"
    yield f"mask of its parent j  = mask {e.parent} - {e.first[LEVEL - 1][1]} + j = mask {mask} + j of its parent chunk"

def nodes_block(e):
    """The chunk's nodes, decoded before with the parent chunk."""
    yield "node  point of parent chunk   x  y  z   normal  colour"
    first = e.first[LEVEL - 1][0]
    rows = zip(e.m.levels[LEVEL - 1].codes[e.node:], e.values(LEVEL - 1, NORMAL, e.node, e.chunk.nodes),
               e.values(LEVEL - 1, COLOUR, e.node, e.chunk.nodes))
    for node, (code, normal, colour) in enumerate(rows):
        yield "{:4} {:22} {:5} {:2} {:2}   0x{:04X}  {:3} {:3} {:3}".format(node, e.node - first + node, *place(code), normal,
                                                                            *colour)

def bytes_block(e):
    """The chunk's entry and its streams."""
    out = Listing(e.m.data)
    out.at = e.chunk.at
    out.fields(CHUNK)
    for name, part in zip(NAMES, e.chunk.parts):
        out.row(4, f"{name}: {part.stored} bytes, filter {part.filter}, zstd {part.zstd}")
    out.lines.append("")
    out.at = e.chunk.offset
    masks, normal, _, colour = e.chunk.parts
    out.row(masks.stored, "masks, one per node")
    for part, names in ((normal, ("codes", "escapes")), (colour, ("green", "red and blue", "escapes"))):
        if part is colour:
            out.fields(FRAME)
        words = struct.unpack_from(f"<{len(names)}I", e.m.data, part.offset)
        for name, size in zip(names, words):
            out.row(4, f"{'normal' if part is normal else 'colour'}: {name} {size} bytes, zstd 0")
        for name, size in zip(names, words):
            out.row(size, name)
    return out.lines

def walk(e, codes, escapes):
    """Of each point its number, node and child, and the position of its code, or None for an only child."""
    counts, at = e.counts(), 0
    for number, (node, child) in enumerate(e.points()):
        if counts[node] == 1:
            yield number, node, child, None, None
        else:
            escape = escapes[2 * codes[:at].count(15):][:2] if codes[at] == 15 else None
            yield number, node, child, at, escape
            at += 1

def pair(code, escape):
    """Text, and the two numbers, of a code with or without an escape."""
    return (f"{code:02X} {escape[0]:02X} {escape[1]:02X}", *escape) if escape else (f"{code:02X}", code & 15, code >> 4)

def normals_block(e):
    """5.8.3 point by point."""
    codes, escapes = e.planes(NORMAL)
    parents = e.values(LEVEL - 1, NORMAL, e.node, e.chunk.nodes)
    values = e.values(LEVEL, NORMAL, e.first[LEVEL][0], e.chunk.points)
    yield "point  node child   x  y  z   parent   u  v   code      A  B  diff. u, v    u  v  index   normal"
    for number, node, child, at, escape in walk(e, codes, escapes):
        where = place(8 * e.m.levels[LEVEL - 1].codes[e.node + node] + child)
        start = "{:5} {:5} {:5} {:3} {:2} {:2}   0x{:04X}".format(number, node, child, *where, parents[node])
        if at is None:
            yield f"{start}           an only child: its parent's value          0x{values[number]:04X}"
            continue
        u, v = CELLS[parents[node] & 1023]
        text, a, b = pair(codes[at], escape)
        cell = ((u + unfold(a & 127)) % 128, (v + unfold(b)) % 64)
        index = NORMAL_OF_CELL[cell]
        assert index ^ parents[node] & 0x3C00 ^ (a & 128) << 6 == values[number]
        yield (f"{start} {u:3} {v:2}   {text:8} {a:2} {b:2} {unfold(a):6} {unfold(b):4} {cell[0]:6} {cell[1]:2}  0x{index:04X}  "
               f"0x{values[number]:04X}")

def colours_block(e):
    """5.8.6 point by point."""
    greens, pairs, escapes = e.planes(COLOUR)
    parents = e.values(LEVEL - 1, COLOUR, e.node, e.chunk.nodes)
    values = e.values(LEVEL, COLOUR, e.first[LEVEL][0], e.chunk.points)
    yield "point  node   parent r   g   b   green  h   code      red blue   r   g   b"
    for number, node, _, at, escape in walk(e, pairs, escapes):
        start = "{:5} {:5} {:10} {:3} {:3}".format(number, node, *parents[node])
        result = " ".join(f"{v:3}" for v in values[number])
        if at is None:
            yield f"{start}   an only child: its parent's value   {result}"
            continue
        text, red, blue = pair(pairs[at], escape)
        h = unfold(greens[at])
        r, g, b = parents[node]
        assert ((r + h + unfold(red)) % 256, (g + h) % 256, (b + h + unfold(blue)) % 256) == values[number]
        yield f"{start}      {greens[at]:02X} {h:3}   {text:8} {unfold(red):4} {unfold(blue):4} {result}"

def blocks(path):
    """The blocks of code of appendix D, in their order."""
    e = Example(bvg.read(Path(path).read_bytes()))
    return ["\n".join(line.rstrip() for line in make(e)) for make in
            (chunks_block, nodes_block, bytes_block, normals_block, colours_block)]

if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    print("\n\n".join(blocks(sys.argv[1])))
