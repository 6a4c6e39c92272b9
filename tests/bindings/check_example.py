#!/usr/bin/env python3
"""The example in Python draws a picture: check_example.py height_map.py"""

import pathlib
import subprocess
import sys
import tempfile

with tempfile.TemporaryDirectory() as folder:
    picture = pathlib.Path(folder) / "terrain.png"
    text = subprocess.run([sys.executable, sys.argv[1], picture], check=True, capture_output=True, text=True).stdout
    print(text)
    stored = picture.read_bytes()
    if not stored.startswith(b"\x89PNG") or len(stored) < 100_000 or "level 7: " not in text:
        sys.exit(f"FAILED: the picture has {len(stored)} bytes")
