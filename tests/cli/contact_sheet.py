#!/usr/bin/env python3
"""bench/contact_sheet.py shows the six sides of a box, whole, and says what it cannot draw:
contact_sheet.py PROGRAMS WORK_FOLDER SOURCE_FOLDER. Exit code 77: ImageMagick is not installed."""

import os
import pathlib
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import pictures  # noqa: E402
from commands import check  # noqa: E402

programs, work, source = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
if not shutil.which("montage"):
    print("skipped: ImageMagick is not installed")
    sys.exit(77)
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)

EDGE, LABEL = 64, 40  # pixels; what a label adds to a row is less
# In the order of the sheet: front, back, left, right, top, bottom of a model whose up axis is y.
SIDES = ((2, 1, "255 0 0"), (2, 0, "0 255 0"), (0, 0, "0 0 255"), (0, 1, "255 255 0"), (1, 1, "0 255 255"), (1, 0, "255 0 255"))


def write_box(path, size):
    vertices, faces = [], []
    for axis, end, colour in SIDES:
        corners = []
        for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
            corner = [0, 0, 0]
            corner[axis], corner[(axis + 1) % 3], corner[(axis + 2) % 3] = end, a, b
            corners.append(" ".join(str(c * s) for c, s in zip(corner, size)) + " " + colour)
        first = len(vertices)
        vertices += corners
        faces.append(f"4 {first} {first + 1} {first + 2} {first + 3}" if end else
                     f"4 {first + 3} {first + 2} {first + 1} {first}")
    path.write_text("ply\nformat ascii 1.0\n" + f"element vertex {len(vertices)}\n" +
                    "".join(f"property float {name}\n" for name in "xyz") +
                    "".join(f"property uchar {name}\n" for name in ("red", "green", "blue")) +
                    f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n" +
                    "\n".join(vertices + faces) + "\n")


write_box(work / "box 100%.ply", (1, 2, 6))
done = subprocess.run([sys.executable, source / "bench/contact_sheet.py", programs, "sheet.png", "box 100%.ply", "none.ply",
                       f"--edge={EDGE}", "--", "--cache=cache", "--quality=fast"], cwd=work, capture_output=True, text=True,
                      env={**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"})
check(done.returncode == 1 and done.stderr == "", f"{done}")
check(done.stdout.startswith("none.ply: not drawn: ") and done.stdout.count("\n") == 1, done.stdout)
subprocess.run(["convert", work / "sheet.png", "-depth", "8", f"PNG24:{work / 'plain.png'}"], check=True)
width, height, channels, pixels = pictures.read_png(work / "plain.png")
check(width == 6 * (EDGE + 4) and EDGE < height < EDGE + LABEL, f"the sheet has {width} x {height} pixels")


def pixel(x, y):
    return pixels[(y * width + x) * channels:][:3]


for number, (_, _, colour) in enumerate(SIDES):
    left, top = number * (EDGE + 4) + 2, 2
    wanted, seen = [int(part) > 0 for part in colour.split()], pixel(left + EDGE // 2, top + EDGE // 2)
    check([part > 60 for part in seen] == wanted, f"side {number} shows {tuple(seen)} in place of {colour}")
    border = {pixel(left + x, top + y) for x in range(EDGE) for y in (0, EDGE - 1)} | \
             {pixel(left + x, top + y) for y in range(EDGE) for x in (0, EDGE - 1)}
    check(len(border) == 1, f"side {number} is cut at its border: {border}")
print("contact sheet: six sides")
