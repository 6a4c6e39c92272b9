#!/usr/bin/env python3
"""The Python package, and a program that uses it, are well-typed: check_types.py PACKAGE"""

import pathlib
import shutil
import subprocess
import sys
import tempfile

PROGRAM = """import numpy as np
import pbm

report = pbm.build(np.zeros((3, 3)), depth=5, output="scan.pbvg", progress=print)
points: int = report.model.info.points
pixels, depths = report.model.render(depth=True)
height: int = report.model.render().shape[0]
with pbm.open("scan.pbvg", private=True) as model:
    radii = model.points(8, dtype=np.float32, offset=model.info.origin)["radii"] + 1
valid: bool = pbm.validate(b"").valid
try:
    pbm.open_ranges(lambda offset, count: bytes(count), 100)
except pbm.FileError as error:
    number: int = error.code + error.errno
print(pbm.__version__)
"""

if not shutil.which("mypy"):
    print("skipped: mypy is not installed")
    sys.exit(77)
with tempfile.TemporaryDirectory() as folder:
    program = pathlib.Path(folder) / "program.py"
    program.write_text(PROGRAM)
    for version in ("3.9", "3.11"):
        subprocess.run(["mypy", "--strict", f"--python-version={version}", f"--cache-dir={folder}", sys.argv[1], program], check=True)
