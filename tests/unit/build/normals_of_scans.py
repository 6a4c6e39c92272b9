#!/usr/bin/env python3
"""Normals estimated for the vertices of real scans: normals_of_scans.py BUILD_TESTS WORK_FOLDER SOURCE_FOLDER LARGEST UNPACKED [SCANS]

Runs the unit test that compares them with the truth where there are scans (scan_folder.py); else the test is skipped
(exit code 77). LARGEST is the size in MB of the largest file that is read: sanitizers are slow.
"""

import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from scan_folder import find_scans

program, work, source = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
largest = float(sys.argv[4]) * 1e6
scans = find_scans(pathlib.Path(sys.argv[5]).resolve(), source, sys.argv[6] if len(sys.argv) > 6 else "")
if scans is None:
    print("skipped: no folder of scans (PBM_SCANS_DIR)")
    sys.exit(77)

work.mkdir(parents=True, exist_ok=True)
for old in work.iterdir():
    old.unlink()
files = [f for f in scans.iterdir() if f.suffix in (".ply", ".obj", ".stl", ".off") and f.stat().st_size <= largest]
for file in files:
    (work / file.name).symlink_to(file.resolve())
if not files:
    print(f"no scan in {scans}")
    sys.exit(1)
test = [program, "--gtest_filter=EstimateNormals.VerticesOfScans"]
sys.exit(subprocess.run(test, env=os.environ | {"PBM_SCANS_DIR": str(work)}).returncode)
