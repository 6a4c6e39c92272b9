"""Golden files, format_spec/golden/VERSION: golden.py --write VERSION PBM_SAMPLE PBM_BUILD, or golden.py to check them

Checks that every golden file of every version is valid and holds what the version's contents.json says. --write makes them,
once, when a version is frozen: the valid test vectors that no earlier version has, and some built scans. It never replaces
a file.
"""

import json
import math
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import xxhash

import bvg

FORMAT = Path(__file__, "../../../format_spec").resolve()
SCANS = {"1.0": {
    "scan-plain": (6, ("--colour", "565",)),
    "scan-colourless": (6, ("--ignore-point-colours", "--up", "z", "--unit", "mm")),
    "scan-everything": (5, ("--texture", "wood", "--ground", "marble", "--ground-resolution", "64", "--lights", "studio", "--shadows",
                            "--shadow-bits", "8", "--panorama", "default", "--panorama-width", "256", "--environment", "0.25",
                            "--name", "Ammonit \u2014 \U0001f41a", "--credit", "\"quoted\" \\ / \u0001")),
    "scan-mapped": (5, ("--store", "mapped", "--material", "mirror", "--lights", "two", "--shadows", "--ground", "plain",
                        "--ground-resolution", "64")),
}, "1.1": {
    "scan-fields": (6, ("--field", "intensity", "--field", "classification", "--field", "height,max,8")),
    "scan-fields-mapped": (5, ("--field", "intensity=0,100,16", "--store", "mapped", "--panorama", "default", "--panorama-width",
                               "256")),
}, "1.2": {
    "scan-closed": (6, ("--field", "intensity", "--colour", "565")),
}, "1.3": {
    "scan-round": (6, ("--up", "z", "--field", "intensity", "--field", "classification")),
    "scan-round-mapped": (5, ("--up", "z", "--store", "mapped", "--field", "classification")),
}, "1.4": {
    "scan-sides": (6, ("--lights", "two", "--shadows")),
    "scan-sides-mapped": (5, ("--colour", "565", "--store", "mapped")),
}, "1.5": {
    "scan-tint": (6, ("--material", "gold,environment=0.6,tint=1", "--panorama", "default", "--panorama-width", "256")),
    "scan-tint-mapped": (5, ("--material", "silver,tint=0.5", "--panorama", "default", "--panorama-width", "256", "--ground",
                             "plain", "--ground-resolution", "64", "--store", "mapped")),
}, "1.6": {}}

def write_cloud(path):
    """Trees on a slope, as points without normals and colours: they lie on no surface, the ground does."""
    state = 1
    def random():
        nonlocal state
        state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
        return (state >> 40) / 2**24
    points = [(x / 4, y / 4, x / 20, 40 + x % 30, 2) for x in range(64) for y in range(64)]
    for _ in range(12):
        east, north = 16 * random(), 16 * random()
        points += [(east + 2 * random(), north + 2 * random(), east / 5 + 1 + 3 * random(), 5 + int(20 * random()), 5)
                   for _ in range(200)]
    head = "".join(f"property {name}\n" for name in ("double x", "double y", "double z", "float intensity", "uchar classification"))
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{head}end_header\n"
    path.write_bytes(head.encode() + b"".join(struct.pack("<dddfB", *point) for point in points))

def write_pot(path):
    """An open pot, red outside and blue inside, whose wall is thinner than a voxel."""
    corners, faces = [], []
    for radius, colour, outside in ((0.5, (200, 40, 30), True), (0.496, (30, 60, 200), False)):
        first = len(corners)
        for ring in range(9):
            for i in range(48):
                angle = 2 * math.pi * i / 48
                corners.append(struct.pack("<fffBBB", radius * math.cos(angle), ring / 8, radius * math.sin(angle), *colour))
        for ring in range(8):
            for i in range(48):
                a, b = first + 48 * ring + i, first + 48 * ring + (i + 1) % 48
                for face in ((a, a + 48, b), (b, a + 48, b + 48)):
                    faces.append(struct.pack("<BIII", 3, *(face if outside else face[::-1])))
    head = "".join(f"property {name}\n" for name in ("float x", "float y", "float z", "uchar red", "uchar green", "uchar blue"))
    head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(corners)}\n{head}"
            f"element face {len(faces)}\nproperty list uchar uint vertex_indices\nend_header\n")
    path.write_bytes(head.encode() + b"".join(corners) + b"".join(faces))

def write_scan(path, sample):
    """The scan of a version: pbm-sample's, with measurements that follow from the number of the vertex."""
    subprocess.run([sample, "-q", "--vertices", "10000", "-o", path], check=True)
    names = ("float intensity", "uchar classification", "double height")
    head, rows = path.read_bytes().split(b"end_header\n")
    count = int(re.search(rb"element vertex (\d+)", head)[1])
    size = sum({"float": 4, "double": 8, "uchar": 1}[kind] for kind in re.findall(r"property (\w+) \w+\n", head.split(b"element face")[0].decode()))
    vertices = b"".join(rows[size * i:size * (i + 1)] + struct.pack("<fBd", i * 37 % 256, i * 7 % 5 + 2, i / 3)
                        for i in range(count))
    more = "".join(f"property {name}\n" for name in names).encode()
    head = head.replace(b"element face", more + b"element face")
    path.write_bytes(head + b"end_header\n" + vertices + rows[size * count:])

SHAPES = {"1.3": write_cloud, "1.4": write_pot} # versions whose scans are not pbm-sample's

def decoded_hash(m):
    """XXH3-128 of all that was decoded: of each level the masks and the values of each stream in the order of the attributes
    section, lit fractions one byte each; of each raster the texels of mip level 0; the stored metadata; of each level the
    stored values of each field; of each level with sides their points and, stream by stream, the values of both; of each level with offsets their points
    and these."""
    h = xxhash.xxh3_128()
    for level in m.levels:
        h.update(bytes(level.masks))
        for values in level.values:
            h.update(bytes(values))
    for _, (_, _, texels, _) in m.rasters:
        h.update(texels)
    h.update(bvg.stored(m, m.section[bvg.METADATA, 0]))
    for values in m.values:
        for field, column in zip(m.fields, values):
            h.update(b"".join(value.to_bytes(field.bytes, "little") for value in column))
    for sides in (*filter(None, m.sides), *filter(None, m.offsets)):
        h.update(b"".join(point.to_bytes(4, "little") for point in sides.points))
        for values in sides.values:
            h.update(bytes(values))
    return h.intdigest().to_bytes(16, "little").hex()

def contents(path):
    m = bvg.read(path.read_bytes())
    return {"file": path.name, "content_id": m.content_id.hex(), "mapped": m.mapped, "points": m.points,
            "levels": [len(level.codes) for level in m.levels], "chunks": [len(chunks) for chunks in m.directories[1:]],
            "attributes": [s.kind for s in m.streams], "materials": len(m.materials), "lights": len(m.lights),
            **({"closed": True} if m.closed else {}),
            **({"round": [i for i, shape in enumerate(m.shapes) if shape]} if any(m.shapes) else {}),
            **({"tints": m.tints} if any(m.tints) else {}),
            **({"sides": [len(sides.points) if sides else 0 for sides in m.sides]} if any(m.sides) else {}),
            **({"offsets": [len(some.points) if some else 0 for some in m.offsets]} if any(m.offsets) else {}),
            "rasters": [[e.type, e.instance, width, height] for e, (width, height, *_) in m.rasters], "decoded": decoded_hash(m)}

def write(version, sample, build):
    folder = FORMAT / "golden" / version
    folder.mkdir(parents=True)
    earlier = {path.read_bytes() for path in FORMAT.glob("golden/*/*.pbvg")}
    for path in sorted(FORMAT.glob("vectors/valid/*.pbvg")):
        if path.read_bytes() not in earlier:
            shutil.copyfile(path, folder / path.name)
    with tempfile.TemporaryDirectory() as temporary:
        scan = Path(temporary, "scan.ply")
        if version in SHAPES:
            SHAPES[version](scan)
        else:
            write_scan(scan, sample)
        for name, (depth, options) in SCANS[version].items():
            model = folder / f"{name}.pbvg"
            subprocess.run([build, "-q", scan, "--depth", str(depth), "-o", model, *options], check=True)
    files = [contents(path) for path in sorted(folder.glob("*.pbvg"))]
    text = json.dumps({"version": version, "files": files}, indent=1, ensure_ascii=False) + "\n"
    (folder / "contents.json").write_text(text, encoding="utf-8")

def check(folder):
    """What is wrong with the golden files of a version, as lines of text."""
    listed = json.loads((folder / "contents.json").read_text(encoding="utf-8"))["files"]
    wrong = [f"{path} is not in contents.json" for path in folder.glob("*.pbvg") if path.name not in {f["file"] for f in listed}]
    for expected in listed:
        try:
            if contents(folder / expected["file"]) != expected:
                wrong.append(f"{folder / expected['file']} holds something else")
        except bvg.BvgError as error:
            wrong.append(f"{folder / expected['file']}: {error}")
    return wrong, len(listed)

def main(arguments):
    if arguments[:1] == ["--write"] and len(arguments) == 4:
        write(*arguments[1:])
    elif arguments:
        sys.exit(__doc__)
    folders, wrong, count = sorted(path.parent for path in FORMAT.glob("golden/*/contents.json")), [], 0
    for folder in folders:
        faults, files = check(folder)
        wrong, count = wrong + faults, count + files
    print("\n".join(wrong), end="\n" if wrong else "")
    print(f"{count} golden files of {len(folders)} versions, {len(wrong)} wrong")
    return 1 if wrong or not folders else 0

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
