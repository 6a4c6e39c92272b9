"""Reads the pictures of pbm-render, with the standard library alone."""

import struct
import zlib


def read_png(path):
    """8-bit RGB or RGBA, not interlaced -> (width, height, channels, bytes of all rows)."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", f"{path} is no PNG"
    at, packed, header = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + size]
        (crc,) = struct.unpack(">I", data[at + 8 + size : at + 12 + size])
        assert crc == zlib.crc32(kind + body), f"{path}: CRC of {kind} is wrong"
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        at += 12 + size
    width, height, bits, colour, _, _, interlaced = header
    channels = {2: 3, 6: 4}[colour]
    assert bits == 8 and interlaced == 0
    raw, stride = zlib.decompress(packed), width * channels
    assert len(raw) == (stride + 1) * height
    rows, above = bytearray(), bytearray(stride)
    for y in range(height):
        start = y * (stride + 1)
        row = unfilter(raw[start], bytearray(raw[start + 1 : start + 1 + stride]), above, channels)
        rows += row
        above = row
    return width, height, channels, bytes(rows)


def unfilter(kind, row, above, step):
    if kind == 2:
        return bytearray((a + b) & 255 for a, b in zip(row, above))
    for i in range(len(row) if kind else 0):
        left = row[i - step] if i >= step else 0
        corner = above[i - step] if i >= step else 0
        if kind == 1:
            row[i] = (row[i] + left) & 255
        elif kind == 3:
            row[i] = (row[i] + (left + above[i]) // 2) & 255
        elif kind == 4:
            guess = left + above[i] - corner
            distances = (abs(guess - left), abs(guess - above[i]), abs(guess - corner))
            row[i] = (row[i] + (left, above[i], corner)[distances.index(min(distances))]) & 255
    return row


def read_pfm(path):
    """Grey PFM -> (width, height, floats, top row first)."""
    kind, size, scale, pixels = path.read_bytes().split(b"\n", 3)
    assert kind == b"Pf", f"{path} is no grey PFM"
    width, height = map(int, size.split())
    assert len(pixels) == 4 * width * height
    values = struct.unpack(("<" if float(scale) < 0 else ">") + f"{width * height}f", pixels)
    rows = [values[y * width : (y + 1) * width] for y in range(height)]
    return width, height, [v for row in reversed(rows) for v in row]
