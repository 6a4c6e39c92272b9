"""A mesh whose walls are thin: an open cylinder of radius 1 and height 2 with an inner and an outer side.

  shells.py FILE.ply THICKNESS
"""
import math
import pathlib
import struct
import sys

COLUMNS, ROWS = 600, 300


def write_shell(path, thickness):
    """A binary PLY without colours. Normals of the outer side point outwards, those of the inner side to the axis."""
    vertices, faces = [], []
    for radius, is_outer in ((1, True), (1 - thickness, False)):
        base = len(vertices)
        turns = [2 * math.pi * column / COLUMNS for column in range(COLUMNS)]
        vertices += [(radius * math.cos(turn), 2 * row / ROWS - 1, radius * math.sin(turn))
                     for row in range(ROWS + 1) for turn in turns]
        for row in range(ROWS):
            for column in range(COLUMNS):
                a, b = base + row * COLUMNS + column, base + row * COLUMNS + (column + 1) % COLUMNS
                c, d = a + COLUMNS, b + COLUMNS
                faces += [(a, c, b), (b, c, d)] if is_outer else [(a, b, c), (b, d, c)]
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
              "property float x\nproperty float y\nproperty float z\n"
              f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    pathlib.Path(path).write_bytes(header.encode() + b"".join(struct.pack("<3f", *vertex) for vertex in vertices)
                                   + b"".join(struct.pack("<B3i", 3, *face) for face in faces))


if __name__ == "__main__":
    write_shell(sys.argv[1], float(sys.argv[2]))
