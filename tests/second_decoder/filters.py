"""Test vectors of the filters, format_spec/vectors/filters.json: filters.py [--write]

Decodes the planes of each case and compares with its values; with --write makes the file anew: of each filter one case from
a file of format_spec/vectors/valid, and one of random planes, as no writer makes them but every reader takes them.
"""

import json
import random
import struct
import sys
from pathlib import Path

import bvg
import fields
import rasters
import streams
from streams import Part, Planes, unrank
from values import COLOUR, MATERIAL, NORMAL, RADIUS, SHADOW, TEXEL, Stream

FOLDER = Path(__file__, "../../../format_spec/vectors").resolve()
NAMES = {1: "masks", 2: "normal", 3: "radius", 4: "colour 565", 5: "colour 888", 6: "material", 7: "texture value", 8: "shadow",
         9: "texels", 10: "field of two bytes"}
KINDS = {2: (NORMAL, 0), 3: (RADIUS, 0), 4: (COLOUR, 1), 5: (COLOUR, 2), 6: (MATERIAL, 0), 7: (TEXEL, 0), 8: (SHADOW, 0)}

class GivenPlanes(Planes):
    """Planes that are there already, raw, instead of in a file."""

    def __init__(self, planes):
        self.part, self.given = Part(0, 0, 0, 0, 0), list(planes)

    def take(self, raw):
        plane = self.given.pop(0)
        self.need(len(plane) == raw, "5.8.1")
        return plane

class KeptPlanes(Planes):
    """Planes of a file, kept."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.kept = []

    def take(self, raw):
        self.kept.append(bytes(super().take(raw)))
        return self.kept[-1]

def values_of(case):
    """What the planes of a case stand for."""
    data = {name: bytes.fromhex(text) for name, text in case.items() if name in ("masks", "parents", "normals", "above")}
    planes, number = GivenPlanes(map(bytes.fromhex, case["planes"])), case["filter"]
    if number == 9:
        texels = len(planes.given[0])
        return rasters.unfilter(planes, texels, case["width"], case["channels"])
    if number == 1:
        normals = struct.unpack(f"<{len(data['normals']) // 2}H", data["normals"])
        return bytes(unrank(planes.take(len(normals)), normals, data["above"]))
    counts = [bin(mask).count("1") for mask in data["masks"]]
    if number == 10:
        return two_bytes(fields.unfilter(planes, 2, struct.unpack(f"<{len(counts)}H", data["parents"]), counts))
    kind, form = KINDS[number]
    bits = [0] * 17
    if number == 8:
        bits[case["level"]], bits[case["level"] - 1] = case["bits"], case["bits_above"]
    return streams.unfilter(case["level"], case["depth"], Stream(kind, form, 0, bits), planes, data["parents"], counts)

def two_bytes(values):
    return struct.pack(f"<{len(values)}H", *values)

def with_values(case):
    return {**case, "values": values_of(case).hex()}

def cases_of_file(path):
    """All filtered streams of a file as cases without values."""
    m = bvg.read(path.read_bytes())
    for level in range(1, m.depth + 1):
        node, parent, first, above, here = 0, 0, 0, m.levels[level - 1], m.levels[level]
        for c in m.directories[level]:
            masks = bytes(here.masks[node:node + c.nodes])
            at = m.index[NORMAL, 0]
            for s, part in zip([None] + m.streams, c.parts):
                if part.filter:
                    planes = KeptPlanes(m, part)
                    case = {"filter": part.filter, "name": f"{NAMES[part.filter]}, level {level} of {path.name}", "level": level,
                            "depth": m.depth, "masks": masks.hex()}
                    if s is None:
                        planes.take(c.nodes)
                        del case["masks"]
                        case["normals"] = bytes(above.values[at][2 * node:2 * (node + c.nodes)]).hex()
                        case["above"] = bytes(above.masks[parent:parent + c.parents]).hex()
                    else:
                        values = above.values[m.streams.index(s)]
                        size = len(values) // len(above.codes)
                        nodes = bytes(values[size * node:size * (node + c.nodes)])
                        streams.unfilter(level, m.depth, s, planes, nodes, [bin(mask).count("1") for mask in masks])
                        case["parents"] = nodes.hex()
                        if s.kind == SHADOW:
                            case["bits"], case["bits_above"] = s.bits[level], s.bits[level - 1]
                    yield c.points, {**case, "planes": [plane.hex() for plane in planes.kept], "written": True}
            node, parent, first = node + c.nodes, parent + c.parents, first + c.points
    for level in range(1, m.depth + 1 if m.fields else 1):
        parts, node = iter(fields.read_directory(m, level)), 0
        for c in m.directories[level]:
            masks = bytes(m.levels[level].masks[node:node + c.nodes])
            for f, above in zip(m.fields, m.values[level - 1]):
                _, part = next(parts)
                if part.filter == 10:
                    planes, nodes = KeptPlanes(m, part), above[node:node + c.nodes]
                    fields.unfilter(planes, 2, nodes, [bin(mask).count("1") for mask in masks])
                    yield c.points, {"filter": 10, "name": f"{NAMES[10]}, level {level} of {path.name}",
                                     "masks": masks.hex(), "parents": two_bytes(nodes).hex(),
                                     "planes": [plane.hex() for plane in planes.kept], "written": True}
            node += c.nodes
    for e, _ in m.rasters:
        r = rasters.read_directory(m, e)
        for (_, _, _, w, h), (part, _) in zip(r.places, r.tiles):
            if part.filter:
                planes = KeptPlanes(m, part, r.channels)
                rasters.unfilter(planes, w * h, w, r.channels)
                yield w * h, {"filter": 9, "name": f"{NAMES[9]} of {path.name}", "width": w, "channels": r.channels,
                              "planes": [plane.hex() for plane in planes.kept], "written": True}

def pairs(rng, count, second=256):
    """Random codes of pairs with their escapes, the first byte of any value, the second below `second`."""
    codes = bytes(rng.choice((15, rng.randrange(15) | rng.randrange(16) << 4)) for _ in range(count))
    return [codes, bytes(rng.randrange(end) for _ in range(codes.count(15)) for end in (256, second))]

def random_case(number, rng):
    """Planes that obey 5.8.1 to 5.8.3, of random bytes."""
    case = {"filter": number, "name": f"{NAMES[number]}, random planes", "level": 6, "depth": 7}
    nodes = 24
    masks = bytes(rng.choice((1 << rng.randrange(8), rng.randrange(1, 256))) for _ in range(nodes))
    counts = [bin(mask).count("1") for mask in masks]
    points, siblings = sum(counts), sum(count for count in counts if count > 1)
    if number == 9:
        planes = [rng.randbytes(64).hex() for _ in range(3)]
        return {"filter": 9, "name": case["name"], "width": 8, "channels": 3, "planes": planes}
    if number == 1:
        normals = struct.pack(f"<{nodes}H", *(rng.randrange(0x4000) for _ in range(nodes)))
        return {**case, "normals": normals.hex(), "above": masks[:4].hex(), "planes": [rng.randbytes(nodes).hex()]}
    planes = {2: lambda: pairs(rng, siblings, 64), 3: lambda: [rng.randbytes(points)], 8: lambda: [rng.randbytes(points)]}
    planes[10] = lambda: [rng.randbytes(siblings), rng.randbytes(siblings)]
    planes.update(dict.fromkeys((4, 5), lambda: [rng.randbytes(siblings)] + pairs(rng, siblings)))
    made = planes.get(number, lambda: [rng.randbytes(siblings)])()
    if number == 8:
        case["bits"], case["bits_above"] = 4, 8
        made = [made[0][:(points + 1) // 2]]
        if points % 2:
            made = [made[0][:-1] + bytes([made[0][-1] & 15])]
    if number == 10:
        parents = rng.randbytes(2 * nodes)
        return {**case, "masks": masks.hex(), "parents": parents.hex(), "planes": [plane.hex() for plane in made]}
    parents = {2: struct.pack(f"<{nodes}H", *(rng.randrange(0x4000) for _ in range(nodes))), 4: rng.randbytes(2 * nodes),
               5: rng.randbytes(3 * nodes)}.get(number, rng.randbytes(nodes))
    return {**case, "masks": masks.hex(), "parents": parents.hex(), "planes": [plane.hex() for plane in made]}

def write(path):
    smallest, rng = {}, random.Random(1)
    for file in sorted(FOLDER.glob("valid/*.pbvg")):
        for points, case in cases_of_file(file):
            if case["filter"] not in smallest or points < smallest[case["filter"]][0]:
                smallest[case["filter"]] = points, case
    cases = [with_values(case) for number in sorted(NAMES) for case in (smallest[number][1], random_case(number, rng))]
    path.write_text(json.dumps({"cases": cases}, indent=1) + "\n", encoding="utf-8")

def main(arguments):
    path = FOLDER / "filters.json"
    if arguments == ["--write"]:
        write(path)
    cases = json.loads(path.read_text(encoding="utf-8"))["cases"]
    wrong = [case["name"] for case in cases if values_of(case).hex() != case["values"]]
    missing = set(NAMES) - {case["filter"] for case in cases}
    print("\n".join(f"wrong: {name}" for name in wrong), end="\n" if wrong else "")
    print(f"{len(cases)} cases, {len(wrong)} wrong, {len(missing)} filters without one")
    return 1 if wrong or missing else 0

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
