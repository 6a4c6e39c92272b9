"""A file of the format as a listing with the meaning of its bytes, for appendix C of the specification: listing.py FILE"""

import sys
from pathlib import Path

import bvg
from header import CHUNKS, DIRECTORY

HEADER = ((8, "magic"), (4, "version {}.{}", "HH"), (4, "endian tag"), (8, "file size {}", "Q"), (8, "section table at {}", "Q"),
          (4, "{} sections", "I"), (4, "depth {}, zero", "Bxxx"), (8, "required features: packed"), (8, "optional features"),
          (8, "{} points", "Q"), (8, "{} raw bytes in all sections", "Q"), (16, "content_id"),
          (16, "root record: normal, colour, material, radius, texture, light"), (4, "chunk limit {}", "I"),
          (4, "zero"), (8, "XXH3-64 of the section table"), (8, "XXH3-64 of bytes 0..119"))
ENTRY = ((8, "type {}: {}; codec {}, flags {}", "IHH"), (8, "instance {}, elements of {} bytes", "II"),
         (8, "alignment {}, zero", "Ixxxx"), (16, "at {}, {} bytes stored", "QQ"), (16, "{} bytes raw, {} elements", "QQ"),
         (8, "XXH3-64 of the stored bytes"))
CHUNK = ((8, "chunk: root prefix {}", "Q"), (8, "XXH3-64 of the stored bytes"),
         (16, "{} points, {} nodes, {} parents, {} bricks", "IIII"), (8, "parent chunk {}; cone axis {}, cosine {}", "IHh"),
         (8, "root depth {}, zero", "B7x"))
GRID = ((24, "grid: minimum corner ({:g}, {:g}, {:g})", "3d"), (8, "voxel size {:g}", "d"),
        (16, "unit {}, up axis {}, zero", "BB14x"))
MATERIAL = ((16, "material: ka {:.2g}, kd {:.2g}, ks {:.2g}, exponent {:g}", "4f"), (4, "colour, zero"),
            (12, "environment blending factor {:g}, zero", "f8x"))
NAMES = {1: "metadata", 2: "grid", 3: "attributes", 4: "materials", DIRECTORY: "directory of level {}",
         CHUNKS: "chunks of level {}"}
PER_LINE = 16

class Listing:
    """Lines of offset, bytes and meaning."""

    def __init__(self, data):
        self.data, self.at, self.lines = data, 0, []

    def row(self, size, meaning):
        for first in range(self.at, self.at + size, PER_LINE):
            part = self.data[first:min(first + PER_LINE, self.at + size)].hex(" ").upper()
            self.lines.append(f"{first:03X}  {part:47}  {meaning if first == self.at else ''}".rstrip())
        self.at += size

    def fields(self, table, name=None):
        """Rows of (size, meaning, format of the values in it). `name` goes with the first value of a section entry."""
        for size, meaning, *form in table:
            values = list(bvg.struct.unpack_from("<" + form[0], self.data, self.at)) if form else []
            if name and form and form[0] == "IHH":
                values.insert(1, name(values[0]))
            self.row(size, meaning.format(*values))

    def gap(self, to):
        if self.at < to:
            self.row(to - self.at, "padding")

def list_section(out, m, e):
    """One of the sections of a file with normals and radii only."""
    out.lines.append("")
    if e.type == DIRECTORY:
        for c in m.directories[e.instance]:
            out.fields(CHUNK)
            for name, part in zip(("masks", "normal", "radius"), c.parts):
                out.row(4, f"{name}: {part.stored} bytes, filter {part.filter}, zstd {part.zstd}")
    elif e.type == CHUNKS:
        for c in m.directories[e.instance]:
            for name, part in zip(("masks of level {}, one per node", "normals of level {}", "radii of level {}"), c.parts):
                out.row(part.stored, name.format(e.instance))
    elif e.type == 2:
        out.fields(GRID)
    elif e.type == 3:
        for s in m.streams:
            out.row(24, f"attribute: kind {s.kind}, format {s.format}, light {s.light}, no bits")
    elif e.type == 4:
        out.fields(MATERIAL)
    else:
        out.row(e.stored, NAMES[e.type])

def listing(path):
    m = bvg.read(Path(path).read_bytes())
    out = Listing(m.data)
    out.fields(HEADER)
    for e in m.entries:
        out.lines.append("")
        out.fields(ENTRY, lambda kind, e=e: NAMES[kind].format(e.instance))
    for e in m.entries:
        out.gap(e.offset)
        list_section(out, m, e)
    return "\n".join(out.lines)

if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    print(listing(sys.argv[1]))
