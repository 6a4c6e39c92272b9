#!/usr/bin/env python3
"""Veined marble as the vertex colours of a PLY mesh, so that scans without colours have some that look like a texture.
usage: marble.py SCAN.ply OUT.ply      reads ASCII and binary little-endian triangles, writes binary little-endian

Based on: Perlin. Improving Noise. 2002
"""
import math
import pathlib
import struct
import sys

# A permutation of 0..255: the lattice's random numbers, twice, so that sums of two of them are an index.
PERMUTATION = 2 * bytes.fromhex(
    "6ab2ba252002fe9a73f3531bf819da7a5bd87b69b8ad40c8ff421cdb2c3b31f763f05560e3295efbbe3c6451527043a8"
    "bc04c627b54dd6efe7986103e17856b0d9cb08c507f1ea0dd5bbf5e0473a069c41c128c4cf2f449fa700e580af4bb101"
    "8b546766ee919d85c7992d3587b77c6e82689671234633e215bf97ed758432b321a937ceac1d2b5a7605586248aa4fc0"
    "c27945e9ebc3cabd59a2b9c9d7130aa47dfdab2ad483d1f99b4972577e86b4dd143ecc3f4c5c74dc77506d88cd7f349e"
    "dee410b68cf65f30a3d0941a2eae8f4e921e8a24ec4a228e0b38fafcdf93e6f4a0a1391f90d30f6c8d173d116b6f1609"
    "3681e80e955d1889d2120ca66526f2a5"
)
# Towards the middles of a cube's edges; four of the twelve stand twice to make 16.
GRADIENTS = (
    (1, 1, 0), (-1, 1, 0), (1, -1, 0), (-1, -1, 0), (1, 0, 1), (-1, 0, 1), (1, 0, -1), (-1, 0, -1),
    (0, 1, 1), (0, -1, 1), (0, 1, -1), (0, -1, -1), (1, 1, 0), (0, -1, 1), (-1, 1, 0), (0, -1, -1),
)
CELLS_PER_SCAN = 8  # lattice cells along the longest edge of the bounding box
OCTAVES = 5
DARK, LIGHT = (40, 44, 58), (236, 230, 218)  # sRGB


def fade(t):
    return t * t * t * (t * (t * 6 - 15) + 10)


def mix(t, a, b):
    return a + t * (b - a)


def noise(x, y, z):
    """Improved Perlin noise, -1..1."""
    cell_x, cell_y, cell_z = math.floor(x), math.floor(y), math.floor(z)
    x, y, z = x - cell_x, y - cell_y, z - cell_z
    cell_x, cell_y, cell_z = cell_x & 255, cell_y & 255, cell_z & 255
    u, v, w = fade(x), fade(y), fade(z)

    def slope(i, j, k):
        a, b, c = GRADIENTS[PERMUTATION[PERMUTATION[PERMUTATION[cell_x + i] + cell_y + j] + cell_z + k] & 15]
        return a * (x - i) + b * (y - j) + c * (z - k)

    return mix(
        w,
        mix(v, mix(u, slope(0, 0, 0), slope(1, 0, 0)), mix(u, slope(0, 1, 0), slope(1, 1, 0))),
        mix(v, mix(u, slope(0, 0, 1), slope(1, 0, 1)), mix(u, slope(0, 1, 1), slope(1, 1, 1))),
    )


def marble(x, y, z):
    """sRGB colour, 8 bits, at a place in lattice cells."""
    turbulence, size = 0.0, 1.0
    for _ in range(OCTAVES):
        turbulence += abs(noise(x / size, y / size, z / size)) * size
        size /= 2
    light = (0.5 + 0.5 * math.sin(2 * math.pi * (0.5 * x + 0.8 * turbulence))) ** 0.6
    return tuple(int(low + light * (high - low) + 0.5) for low, high in zip(DARK, LIGHT))


TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d",
         "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f",
         "float64": "d"}


def read_triangles(path):
    """Positions and faces of a PLY file with an element vertex, then an element face of nothing but triangles."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    ascii_body, elements = False, []
    for line in data[:end].decode("latin-1").splitlines():
        words = line.split()
        if words[0] == "format":
            ascii_body = words[1] == "ascii"
            if words[1] == "binary_big_endian":
                sys.exit(f"{path}: big-endian files are not read")
        elif words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property":
            elements[-1][2].append(words[1:])
    (vertex, vertices, properties), (face, faces, lists) = elements
    if (vertex, face) != ("vertex", "face") or len(lists) != 1 or lists[0][:2] != ["list", "uchar"]:
        sys.exit(f"{path}: not a plain mesh of vertices and faces")
    xyz = [[p[1] for p in properties].index(axis) for axis in "xyz"]
    if ascii_body:
        lines = data[end:].decode("ascii").split("\n")
        rows = (list(map(float, line.split())) for line in lines[:vertices])
        corners = [tuple(map(int, line.split())) for line in lines[vertices : vertices + faces]]
    else:
        row = struct.Struct("<" + "".join(TYPES[p[0]] for p in properties))
        rows = row.iter_unpack(data[end : end + row.size * vertices])
        triangle = struct.Struct("<B3" + TYPES[lists[0][2]])
        start = end + row.size * vertices
        corners = list(triangle.iter_unpack(data[start : start + triangle.size * faces]))
    if any(corner[0] != 3 for corner in corners):
        sys.exit(f"{path}: not a mesh of triangles only")
    return [tuple(row[i] for i in xyz) for row in rows], [corner[1:] for corner in corners]


HEADER = """ply
format binary_little_endian 1.0
element vertex {}
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face {}
property list uchar int vertex_indices
end_header
"""


def write_marble(scan, out):
    """The mesh `scan` with marble as its colours; the same bytes every time."""
    positions, triangles = read_triangles(scan)
    low = [min(p[axis] for p in positions) for axis in range(3)]
    high = [max(p[axis] for p in positions) for axis in range(3)]
    scale = CELLS_PER_SCAN / max(b - a for a, b in zip(low, high))
    vertex, face = struct.Struct("<fffBBB"), struct.Struct("<Biii")
    body = bytearray()
    for p in positions:
        body += vertex.pack(*p, *marble(*((c - corner) * scale for c, corner in zip(p, low))))
    for triangle in triangles:
        body += face.pack(3, *triangle)
    part = out.with_name(out.name + ".part")
    part.write_bytes(HEADER.format(len(positions), len(triangles)).encode() + body)
    part.replace(out)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    write_marble(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
