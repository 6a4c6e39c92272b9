#!/usr/bin/env python3
"""Real scans become pictures: scans.py PROGRAMS WORK_FOLDER SOURCE_FOLDER LARGEST UNPACKED [SCANS]

SCANS is a folder of PLY, OBJ, STL and OFF files, found as scan_folder.py says; without one the test is skipped (exit code
77). LARGEST is the size limit of a scan in MB, since sanitizers are slow.
"""

import pathlib
import subprocess
import sys

import pictures

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from scan_folder import find_scans

programs, work, source = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
largest = float(sys.argv[4]) * 1e6
scans = find_scans(pathlib.Path(sys.argv[5]).resolve(), source, sys.argv[6] if len(sys.argv) > 6 else "")
work.mkdir(parents=True, exist_ok=True)
if scans is None:
    print("skipped: no folder of scans (PBM_SCANS_DIR)")
    sys.exit(77)


def run(program, *arguments):
    command = [str(programs / program), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=600)


def walk(scan):
    """Builds and draws the scan; returns what went wrong, or None."""
    model, picture = work / (scan.name + ".pbvg"), work / (scan.name + ".png")
    model.unlink(missing_ok=True)
    built = run("pbm-build", "-q", scan, "-o", model)
    if built.returncode != 0:
        return f"pbm-build: {built.returncode}: {built.stderr}"
    validated = run("pbm-validate", model)
    if validated.returncode != 0:
        return f"pbm-validate: {validated.stdout}{validated.stderr}"
    drawn = run("pbm-render", model, "-o", picture, "--resolution", "320,240")
    if drawn.returncode != 0:
        return f"pbm-render: {drawn.returncode}: {drawn.stderr}"
    width, height, channels, pixels = pictures.read_png(picture)
    seen = sum(pixels[i : i + 3] != pixels[0:3] for i in range(0, len(pixels), channels))
    return None if seen > width * height // 50 else f"only {seen} pixels are drawn"


files = sorted(f for f in scans.iterdir() if f.suffix in (".ply", ".obj", ".stl", ".off"))
files = [f for f in files if f.stat().st_size <= largest]
failed = 0
for scan in files:
    problem = walk(scan)
    failed += problem is not None
    print(f"{scan.name}: {problem or 'good'}", flush=True)
print(f"{len(files)} scans, {failed} failed")
sys.exit(1 if failed or not files else 0)
