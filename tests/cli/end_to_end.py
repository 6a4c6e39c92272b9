#!/usr/bin/env python3
"""From a scan to a picture: end_to_end.py PROGRAMS WORK_FOLDER"""

import json
import math
import pathlib
import shutil
import sys

import pictures

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from commands import check, must  # noqa: E402

programs, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def run(program, *arguments):
    return must(programs / program, *arguments, cwd=work, timeout=300)


def same(a, b):
    check((work / a).read_bytes() == (work / b).read_bytes(), f"{a} and {b} differ")


run("pbm-sample", "--vertices", 20000, "-q", "-o", "scan.ply")

# The bytes are the same for any number of threads and in a second build.
for threads in (1, 2, 5):
    run("pbm-build", "-q", "-j", threads, "--depth", 8, "scan.ply", "-o", f"j{threads}.pbvg")
same("j1.pbvg", "j2.pbvg")
same("j1.pbvg", "j5.pbvg")

verdict = run("pbm-validate", "j1.pbvg")
check(verdict.startswith("VALID j1.pbvg"), "pbm-validate says " + verdict)

info = json.loads(run("pbm-info", "--json", "j1.pbvg"))
check(info["file_bytes"] == (work / "j1.pbvg").stat().st_size, "pbm-info: file_bytes is wrong")
check(info["depth"] == 8 and len(info["levels"]) == 8, "pbm-info: depth or levels are wrong")
check(info["levels"][-1]["points"] == info["points"] > 10000, f"pbm-info: {info['points']} points")
points = [level["points"] for level in info["levels"]]
check(points == sorted(points), "pbm-info: a finer level has fewer points")
check(info["voxel_size"] > 0, "pbm-info: voxel_size is wrong")
for stream in info["streams"]:
    check({"type", "stored_bytes", "raw_bytes"} <= set(stream), "pbm-info: a stream lacks a key")
stored = sum(stream["stored_bytes"] for stream in info["streams"])
check(stored <= info["file_bytes"], "pbm-info: streams are larger than the file")

statistics = json.loads(run("pbm-build", "--json", "--depth", 8, "scan.ply", "-o", "again.pbvg"))
check(statistics, "pbm-build --json is empty")
same("j1.pbvg", "again.pbvg")

# In the picture the model covers a large part, has many colours and does not touch the border.
size = ("--resolution", "320,240", "--quality", "fast")
run("pbm-render", "j1.pbvg", "-o", "a.png", "--depth-output", "a.pfm", *size)
width, height, channels, pixels = pictures.read_png(work / "a.png")
check((width, height) == (320, 240), f"the picture has {width}x{height} pixels")
colour = [pixels[i : i + 3] for i in range(0, len(pixels), channels)]
background = colour[0]
check(background == b"\x33\x33\x33", f"the background is {background.hex()}, not 0.2 grey")
border = [colour[y * width + x] for y in range(height) for x in (0, width - 1)]
border += [colour[y * width + x] for x in range(width) for y in (0, height - 1)]
check(all(c == background for c in border), "the model touches the border of the picture")
drawn = [c != background for c in colour]
check(0.15 < sum(drawn) / len(drawn) < 0.9, f"{sum(drawn)} of {len(drawn)} pixels are drawn")
check(len(set(colour)) > 200, f"only {len(set(colour))} colours")

# Depth is positive, and finite exactly where a point was drawn.
depth_width, depth_height, depth = pictures.read_pfm(work / "a.pfm")
check((depth_width, depth_height) == (width, height), "depth has another size")
wrong = sum(math.isfinite(z) != d for z, d in zip(depth, drawn))
check(wrong <= len(drawn) // 1000, f"depth and colour disagree about {wrong} pixels")
check(all(z > 0 for z in depth), "depth is not positive")

# The other model gives the same picture; --no-background makes it transparent.
run("pbm-render", "j2.pbvg", "-o", "b.png", "--depth-output", "b.pfm", *size)
same("a.png", "b.png")
same("a.pfm", "b.pfm")
run("pbm-render", "j1.pbvg", "-o", "c.png", "--no-background", *size)
_, _, channels, pixels = pictures.read_png(work / "c.png")
check(channels == 4, "--no-background has no alpha")
alpha = pixels[3::4]
check(alpha[0] == 0 and max(alpha) == 255, "--no-background is not transparent outside and opaque inside")
check(sum((a > 0) != math.isfinite(z) for a, z in zip(alpha, depth)) == 0, "alpha and depth disagree")

# A camera behind the model gives another picture.
centre = [o + info["voxel_size"] * 2 ** info["depth"] / 2 for o in info["origin"]]
behind = [centre[0], centre[1], centre[2] - 4 * info["voxel_size"] * 2 ** info["depth"]]
run("pbm-render", "j1.pbvg", "-o", "d.png", *size, "--camera-position", ",".join(map(str, behind)),
    "--camera-focal-point", ",".join(map(str, centre)))
check((work / "d.png").read_bytes() != (work / "a.png").read_bytes(), "the camera does not move")
_, _, channels, pixels = pictures.read_png(work / "d.png")
check(any(pixels[i : i + 3] != background for i in range(0, len(pixels), channels)), "nothing is seen from behind")

# The model has no lights: its light stays beside the eye, unless it is to stay with the model.
def brightness(name):
    return sum(pictures.read_png(work / name)[3])

from_behind = (*size, "--camera-position", ",".join(map(str, behind)), "--camera-focal-point", ",".join(map(str, centre)))
for follows in ("eye", "model"):
    run("pbm-render", "j1.pbvg", "-o", f"{follows}.png", *from_behind, f"--light-follows={follows}")
same("eye.png", "d.png")
check(brightness("model.png") < 0.95 * brightness("d.png"), "the light follows the eye although it is to stay")

print(f"{info['points']} points, {info['file_bytes']} bytes, {sum(drawn)} pixels drawn")
