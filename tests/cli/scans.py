#!/usr/bin/env python3
"""Real scans become pictures: scans.py PROGRAMS WORK_FOLDER SOURCE_FOLDER LARGEST [SCANS]

SCANS (or the environment's PBM_SCANS_DIR) is a folder of PLY, OBJ, STL and OFF files. Without it, ../shared/data beside
the checkout is unpacked, if it is there; else the test is skipped (exit code 77). LARGEST is the size in MB of the
largest file to walk with: sanitizers are slow.
"""

import os
import pathlib
import shutil
import subprocess
import sys

import pictures

programs, work, source = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
largest = float(sys.argv[4]) * 1e6
scans = os.environ.get("PBM_SCANS_DIR") or (sys.argv[5] if len(sys.argv) > 5 else "")
work.mkdir(parents=True, exist_ok=True)

if not scans:
    archive = source.parent / "shared" / "data" / "unpack.sh"
    if not archive.exists() or not shutil.which("zstd"):
        print("skipped: no folder of scans (PBM_SCANS_DIR)")
        sys.exit(77)
    scans = work / "unpacked"
    if not (scans / "complete").exists():
        subprocess.run(["bash", archive, scans], check=True)
        (scans / "complete").touch()


def run(program, *arguments):
    command = [str(programs / program), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=600)


def walk(scan):
    """What is wrong with the way of this scan to a picture, or None."""
    model, picture = work / (scan.name + ".bvg"), work / (scan.name + ".png")
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


files = sorted(f for f in pathlib.Path(scans).iterdir() if f.suffix in (".ply", ".obj", ".stl", ".off"))
files = [f for f in files if f.stat().st_size <= largest]
failed = 0
for scan in files:
    problem = walk(scan)
    failed += problem is not None
    print(f"{scan.name}: {problem or 'good'}", flush=True)
print(f"{len(files)} scans, {failed} failed")
sys.exit(1 if failed or not files else 0)
