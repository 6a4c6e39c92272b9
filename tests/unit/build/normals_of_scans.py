#!/usr/bin/env python3
"""Normals estimated for the vertices of real scans: normals_of_scans.py PROGRAM SOURCE_FOLDER LARGEST UNPACKED [SCANS]

Runs the program normals_of_scans where there are scans (scan_folder.py); exit code 77 where there are none. LARGEST is
the size in MB of the largest file that is read: sanitizers are slow.
"""

import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from scan_folder import find_scans

source, unpacked = pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[4]).resolve()
scans = find_scans(unpacked, source, sys.argv[5] if len(sys.argv) > 5 else "")
if scans is None:
    print("skipped: no folder of scans (PBM_SCANS_DIR)")
    sys.exit(77)
files = sorted(f for f in scans.iterdir() if f.suffix in (".ply", ".obj", ".stl", ".off"))
files = [f for f in files if f.stat().st_size <= float(sys.argv[3]) * 1e6]
sys.exit(subprocess.run([sys.argv[1], *files]).returncode)
