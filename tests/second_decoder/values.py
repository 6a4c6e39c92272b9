"""Values of attribute streams: normals, radii, colours (sections 5.8.3 and 6 of the specification)."""

import functools
import itertools
import math
import struct
from collections import namedtuple

NORMAL, RADIUS, COLOUR, MATERIAL, TEXEL, SHADOW = range(1, 7)

Stream = namedtuple("Stream", "kind format light bits")

def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

def make_sums():
    """6.1.2: the sums of the corners for the 1,024 indices of the positive octant."""
    def mid(a, b):
        return tuple((i + j) // 2 for i, j in zip(a, b))
    triangles = [((32, 0, 0), (0, 32, 0), (0, 0, 32))]
    for _ in range(5):
        below = []
        for x, y, z in triangles:
            yz, zx, xy = mid(y, z), mid(z, x), mid(x, y)
            below += [(yz, zx, xy), (x, xy, zx), (xy, y, yz), (zx, yz, z)]
        triangles = below
    return [tuple(map(sum, zip(*corners))) for corners in triangles]

def make_normals():
    """6.1.1, 6.1.2: the 8,192 normals in binary64."""
    normals = []
    for signs in range(8):
        for c in NORMAL_SUMS:
            length = math.sqrt(dot(c, c))
            normals.append(tuple((-v if signs >> k & 1 else v) / length for k, v in enumerate(c)))
    return normals

def round_away(v):
    """To an integer, halves away from zero (6.1.5); adding 0.5 is exact enough here, no value lies next to a half."""
    return int(math.copysign(math.floor(abs(v) + 0.5), v))

def cell(index):
    """5.8.3: the place of a normal on the map."""
    x, y, _ = NORMAL_SUMS[index & 1023]
    a, b = (96 - y, 96 - x) if index & 0x1000 else (x, y)
    u, v = 2 * (a // 3) + a % 3 - 1, b // 3
    return 63 - u if index & 0x400 else 64 + u, 31 - v if index & 0x800 else 32 + v

NORMAL_SUMS = make_sums()
NORMALS = make_normals()
CELLS = [cell(i) for i in range(8192)]
NORMAL_OF_CELL = {place: i for i, place in enumerate(CELLS)}
INTEGER_NORMALS = [tuple(round_away(32767 * v) for v in n) for n in NORMALS]

@functools.lru_cache(maxsize=None)
def normal_index(v):
    """6.1.3. The largest product lies in the octant of v; one with a lower index can tie only where all components of the
    other sign vanish in rounding."""
    x, y, z = map(float, v)
    home = (x < 0) | (y < 0) << 1 | (z < 0) << 2
    best = max([(x * a + y * b) + z * c for a, b, c in NORMALS[1024 * home:1024 * home + 1024]])
    for octant in range(home + 1):
        if all(abs(v[k]) * 1e13 <= best for k in range(3) if (octant ^ home) >> k & 1):
            values = [(x * a + y * b) + z * c for a, b, c in NORMALS[1024 * octant:1024 * octant + 1024]]
            if best in values:
                return 1024 * octant + values.index(best)
    raise AssertionError("no normal has the largest product")

def holding_triangle(v):
    """5.11.3: the index of the triangle of 6.1.2 that holds a vector of integers."""
    index = sum((x < 0) << 10 + k for k, x in enumerate(v))
    rest = [32 * abs(x) for x in v]
    half = sum(rest) // 2
    for shift in range(8, -1, -2):
        corner = next((k for k in range(3) if rest[k] > half), None)
        if corner is None:
            rest = [half - x for x in rest]
        else:
            rest[corner] -= half
            index |= corner + 1 << shift
        half //= 2
    return index

K = (1099511627776, 1164891991447, 1234160073853, 1307547050779, 1385297844439, 1467671940878,
     1554944255987, 1647406053004, 1745365914582, 1849150772653, 1959106999532, 2075601563905)
RADII = [K[(i + 9) % 12] >> (22 - (i + 9) // 12) for i in range(256)]                       # 6.2.1

@functools.lru_cache(maxsize=None)
def covering_radius(level, child):
    """6.2.3: the index that covers children of index `child`."""
    least = RADII[child] + (476102500705 >> level)
    return next((i for i, r in enumerate(RADII) if r >= least), 255)

def srgb(v):
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4

LINEAR = [round(65535 * srgb(v / 255)) for v in range(256)]     # 6.3.3; check_text.py holds it against the table there

@functools.lru_cache(maxsize=None)
def from_linear(v):
    return min(range(256), key=lambda i: abs(LINEAR[i] - v))

def expand565(v):
    """6.3.1, 6.3.2."""
    r, g, b = v >> 11, v >> 5 & 63, v & 31
    return (r << 3 | r >> 2, g << 2 | g >> 4, b << 3 | b >> 2)

def pack565(c):
    r, g, b = ((n * v + 127) // 255 for n, v in zip((31, 63, 31), c))
    return r << 11 | g << 5 | b

def colours(form, data):
    """The colours of a stream, 8 bits a channel."""
    if form == 1:
        return [expand565(v) for v in struct.unpack(f"<{len(data) // 2}H", data)]
    return [tuple(data[i:i + 3]) for i in range(0, len(data), 3)]

def elements(stream, data):
    """The values of a stream: numbers, or colours as triples of the format's own bits."""
    if stream.kind == NORMAL:
        return struct.unpack(f"<{len(data) // 2}H", data)
    if stream.kind == COLOUR and stream.format == 1:
        return [(v >> 11, v >> 5 & 63, v & 31) for v in struct.unpack(f"<{len(data) // 2}H", data)]
    return list(zip(data[::3], data[1::3], data[2::3])) if stream.kind == COLOUR else data

def stream_bytes(stream, values):
    """The inverse of `elements`."""
    if stream.kind == NORMAL:
        return struct.pack(f"<{len(values)}H", *values)
    if stream.kind == COLOUR and stream.format == 1:
        return struct.pack(f"<{len(values)}H", *(r << 11 | g << 5 | b for r, g, b in values))
    return bytes(itertools.chain.from_iterable(values)) if stream.kind == COLOUR else bytes(values)
