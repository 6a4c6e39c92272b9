#!/usr/bin/env python3
"""Exported points, built again on the same grid, are the same model: round_trips.py PROGRAMS WORK_FOLDER SOURCE_FOLDER LARGEST UNPACKED [SCANS]

Exported points have no surface offsets, and so pictures are those of models of a given depth, which have none either.

Uses the sample scan, and real scans if scan_folder.py finds them. Two models are the same if their pictures and their
content ids are; the id covers grid, unit, materials, the voxels of all levels and all attributes of the finest.
"""

import json
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from scan_folder import find_scans

programs, work, source = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
largest = float(sys.argv[4]) * 1e6
scans = find_scans(pathlib.Path(sys.argv[5]).resolve(), source, sys.argv[6] if len(sys.argv) > 6 else "")
work.mkdir(parents=True, exist_ok=True)

# Names of scans as in ../shared/data; missing scans are skipped.
DEPTHS = range(5, 10)  # a mesh at depth 11 has 15 million points, which take minutes
CASES = [("sample.ply", ["--depth", str(depth)]) for depth in DEPTHS]
CASES += [("sample.ply", ["--depth", "8", "--unit", unit]) for unit in ("unknown", "m", "mm", "cm", "in", "ft", "km")]
CASES += [("sample.ply", ["--depth", "8", "--up", axis]) for axis in "xyz"]
CASES += [
    ("sample.ply", ["--origin", "8500000.123,-8412345.678,512.25"]),
    ("sample.ply", ["--origin", "8500000.123,-8412345.678,512.25", "--scale", "0.001"]),
    ("sample.ply", ["--voxel-size", "0.01", "--colour", "565"]),
]
CASES += [("lion_takanawa_rgb_normals_le.ply", ["--depth", str(depth)]) for depth in range(5, 12)]
CASES += [("gargo.ply", ["--depth", str(depth)]) for depth in DEPTHS]
CASES += [
    ("lion_takanawa_rgb_normals_le.ply", ["--colour", "565", "--origin", "8500000.123,5123456.789,80"]),
    ("happy_points_normals_be_thin.ply", []),
    ("colored_airplane.ply", ["--depth", "9"]),
    ("spot.obj", ["--voxel-size", "0.01"]),
    ("bunny_draco.stl", ["--depth", "9"]),
    ("bunny_draco.stl", []),
]


def run(program, *arguments):
    result = subprocess.run([str(programs / program), *map(str, arguments)], capture_output=True, text=True, timeout=600)
    if result.returncode != 0:
        raise RuntimeError(f"{program}: {result.returncode}: {result.stderr}")
    return result.stdout


def content(model):
    return json.loads(run("pbm-info", "--json", model))["content_id"]


def find(name):
    if name == "sample.ply":
        scan = work / name
        if not scan.exists():
            run("pbm-sample", "-q", "--vertices", 20000, "-o", scan)
        return scan
    if scans is None:
        return None
    scan = scans / name
    return scan if scan.exists() and scan.stat().st_size <= largest else None


def draws(scan, options, model):
    """Whether the case compares pictures as well."""
    given_depth = options == ["--depth", "9"] and scan.name in ("colored_airplane.ply", "bunny_draco.stl")
    return given_depth or (not options and json.loads(run("pbm-info", "--json", model))["points_with_offsets"] == 0)


def round_trip(scan, options):
    first, points, second = (work / name for name in ("first.pbvg", "points.ply", "second.pbvg"))
    run("pbm-build", "-q", scan, "-o", first, *options)
    run("pbm-export", "-q", first, "-o", points)
    colour = ["--colour", "565"] if "565" in options else []
    run("pbm-build", "-q", "--strict", points, "--grid-like", first, "-o", second, *colour)
    if content(first) != content(second):
        return "another content"
    if not draws(scan, options, first):
        return None
    pictures = []
    for model in (first, second): # points alone are never known to be closed, as a mesh is
        run("pbm-render", model, "-o", work / "picture.png", "--resolution", "320,240", "--backs", "show")
        pictures.append((work / "picture.png").read_bytes())
    return None if pictures[0] == pictures[1] else "another picture"


done = failed = 0
for name, options in CASES:
    scan = find(name)
    if scan is None or (largest < 100e6 and "--depth" in options and int(options[1]) > 9):
        continue
    done += 1
    try:
        problem = round_trip(scan, options)
    except RuntimeError as error:
        problem = str(error)
    failed += problem is not None
    print(f"{name} {' '.join(options)}: {problem or 'same'}", flush=True)
print(f"{done} round trips, {failed} failed")
sys.exit(1 if failed or done == 0 else 0)
