"""Averages of the finest points (section 7 of the specification)."""

import struct

from values import (COLOUR, INTEGER_NORMALS, LINEAR, MATERIAL, NORMAL, RADIUS, SHADOW, TEXEL, colours, covering_radius, dot,
                    from_linear, normal_index, pack565)

def mean(s, v):
    return (2 * s + v) // (2 * v)

class Sums:
    """What section 7 adds up, for each node of a level: lists that `up` folds into those of the level above."""

    def __init__(self, m):
        values, at = m.levels[m.depth].values, m.index
        stored_normals = struct.unpack(f"<{m.points}H", values[at[NORMAL, 0]])
        normals = [INTEGER_NORMALS[n & 8191] for n in stored_normals]
        self.columns = {"V": [1] * m.points}
        for i in range(3):
            self.columns["S", i] = [n[i] for n in normals]
            for j in range(i, 3):
                self.columns["M", i, j] = [n[i] * n[j] for n in normals]
        for s, data in zip(m.streams, values):
            if s.kind == COLOUR:
                for k, channel in enumerate(zip(*colours(s.format, data))):
                    self.columns["C", k] = [LINEAR[v] for v in channel]
            elif s.kind == MATERIAL:
                for k in range(len(m.materials)):
                    self.columns["votes", k] = [int(v == k) for v in data]
            elif s.kind in (TEXEL, SHADOW):
                self.columns[s.kind, s.light] = list(data)
        self.two_sided = [n >> 13 & 1 for n in stored_normals]
        self.radius = list(values[at[RADIUS, 0]])

    def up(self, starts, level):
        """Fold into `level`, where node i has the children starts[i]..starts[i + 1] - 1 (7.3 to 7.5)."""
        spans = [slice(*ends) for ends in zip(starts, starts[1:])]
        self.columns = {name: [sum(column[s]) for s in spans] for name, column in self.columns.items()}
        self.two_sided = [max(self.two_sided[s]) for s in spans]
        self.radius = [covering_radius(level, max(self.radius[s])) for s in spans]
        self.normals = [self.normal(i) for i in range(len(spans))]

    def normal(self, i):
        """7.2, 7.3: the normal of node i; sets its two-sided flag."""
        c = self.columns
        s = tuple(c["S", k][i] for k in range(3))
        if self.two_sided[i] or 4 * dot(s, s) < (32767 * c["V"][i]) ** 2:
            self.two_sided[i] = 1
            k = max(range(3), key=lambda n: c["M", n, n][i])
            column = tuple(float(c["M", min(j, k), max(j, k)][i]) for j in range(3))
            return 0x2000 | normal_index(tuple(-v for v in column) if dot(column, tuple(map(float, s))) < 0 else column)
        return normal_index(s)

    def stream(self, m, s, level):
        """The values of one stream at the level reached, as Level keeps them."""
        c, votes = self.columns, self.columns["V"]
        if s.kind == NORMAL:
            return struct.pack(f"<{len(votes)}H", *self.normals)
        if s.kind == RADIUS:
            return bytes(self.radius)
        if s.kind == COLOUR:
            rows = [tuple(from_linear(mean(x, v)) for x in sums)
                    for *sums, v in zip(c["C", 0], c["C", 1], c["C", 2], votes)]
            return b"".join(struct.pack("<H", pack565(row)) if s.format == 1 else bytes(row) for row in rows)
        if s.kind == MATERIAL:
            counts = [c["votes", k] for k in range(len(m.materials))]
            return bytes(row.index(max(row)) for row in zip(*counts))
        if s.kind == TEXEL:
            return bytes(mean(x, v) for x, v in zip(c[s.kind, 0], votes))
        finest, here = (255 // (2 ** s.bits[k] - 1) for k in (m.depth, level))
        return bytes(mean(x * finest, v * here) for x, v in zip(c[s.kind, s.light], votes))

def root_record(m, sums):
    """The 16 bytes of section 2, from the streams of level 0."""
    of = {(s.kind, s.light): sums.stream(m, s, 0) for s in m.streams}
    colour = colours(m.streams[m.index[COLOUR, 0]].format, of[COLOUR, 0])[0] if (COLOUR, 0) in of else (0, 0, 0)
    lit = b"".join(of[SHADOW, s.light] for s in m.shadows)
    return (of[NORMAL, 0] + bytes(colour) + of.get((MATERIAL, 0), b"\0") + of[RADIUS, 0] + of.get((TEXEL, 0), b"\0")
            + lit.ljust(8, b"\0"))
