"""A glTF file whose relief is a normal map: a sphere of 24 x 12 quads with dimples.

  dimples.py FILE.glb [SIZE]      SIZE: texels of the map's height, 512 by default
"""
import json
import math
import pathlib
import struct
import sys
import zlib

COLUMNS, ROWS = 24, 12


def height(u, v):
    """Height of the relief at a place of the map, in radii of the sphere."""
    dimples = sum(math.cos(2 * math.pi * n * u + p) * math.sin(math.pi * m * v) ** 2 / n
                  for n, m, p in ((7, 5, 0.3), (19, 11, 1.7), (41, 23, 4.1)))
    return 0.03 * dimples * math.sin(math.pi * v) ** 2


def png(width, rows):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, len(rows), 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows))) + chunk(b"IEND", b""))


def normal_map(size):
    width = 2 * size
    heights = [[height((x + 0.5) / width, (y + 0.5) / size) for x in range(width)] for y in range(size)]
    rows = []
    for y in range(size):
        across = 2 * math.pi * max(math.sin(math.pi * (y + 0.5) / size), 0.05) / width  # of a texel, radii
        down = math.pi / size
        row = bytearray()
        for x in range(width):
            east = (heights[y][(x + 1) % width] - heights[y][x - 1]) / (2 * across)
            south = (heights[min(y + 1, size - 1)][x] - heights[max(y - 1, 0)][x]) / (2 * down)
            scale = 1 / math.sqrt(east * east + south * south + 1)
            row += bytes(int((part * scale + 1) * 127.5 + 0.5) for part in (-east, south, 1))
        rows.append(bytes(row))
    return png(width, rows)


def sphere():
    """Positions, which are the normals too, places in the map, and corners of triangles."""
    positions, places, corners, numbers = [], [], [], {}

    def vertex(row, column):
        if (row, column) not in numbers:
            numbers[row, column] = len(numbers)
            turn, tilt = 2 * math.pi * column / COLUMNS, math.pi * row / ROWS
            positions.append((math.sin(tilt) * math.cos(turn), math.cos(tilt), -math.sin(tilt) * math.sin(turn)))
            places.append((column / COLUMNS, row / ROWS))
        return numbers[row, column]

    for row in range(ROWS):
        for column in range(COLUMNS):
            quad = [(row, column), (row + 1, column), (row, column + 1), (row + 1, column + 1)]
            if row > 0:
                corners += [vertex(*quad[i]) for i in (0, 1, 2)]
            if row < ROWS - 1:
                corners += [vertex(*quad[i]) for i in (2, 1, 3)]
    return positions, places, corners


def glb(size):
    positions, places, corners = sphere()
    parts = [struct.pack(f"<{3 * len(positions)}f", *sum(positions, ())), struct.pack(f"<{2 * len(places)}f", *sum(places, ())),
             struct.pack(f"<{len(corners)}I", *corners), normal_map(size)]
    views, binary = [], b""
    for part in parts:
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(part)})
        binary += part + bytes(-len(part) % 4)
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"normalTexture": {"index": 0}, "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.7}}],
        "textures": [{"source": 0}], "images": [{"bufferView": 3, "mimeType": "image/png"}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": len(positions),
                       "min": [-1, -1, -1], "max": [1, 1, 1]},
                      {"bufferView": 1, "componentType": 5126, "type": "VEC2", "count": len(places)},
                      {"bufferView": 2, "componentType": 5125, "type": "SCALAR", "count": len(corners)}],
        "bufferViews": views, "buffers": [{"byteLength": len(binary)}]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return (struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary)) + struct.pack("<I4s", len(text), b"JSON") + text
            + struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def write_dimples(path, size=512):
    pathlib.Path(path).write_bytes(glb(size))


if __name__ == "__main__":
    write_dimples(sys.argv[1], *map(int, sys.argv[2:]))
