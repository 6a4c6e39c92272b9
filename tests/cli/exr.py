#!/usr/bin/env python3
"""Reads the .exr of pbm-render with OpenImageIO's oiiotool and OpenEXR's exrinfo: exr.py PROGRAMS WORK_FOLDER

The colours must be those of the PNG, the depths of fast pictures those of the PFM; channels have the names and types that
docs/how-to/draw-pictures.md promises.
"""

import array
import pathlib
import re
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import pictures  # noqa: E402
from commands import check, must  # noqa: E402

programs, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
SKIPPED, WIDTH, HEIGHT = 77, 60, 40
for tool in ("oiiotool", "exrinfo"):
    if shutil.which(tool) is None:
        print(f"{tool} is not installed (packages openimageio-tools, openexr): skipped")
        sys.exit(SKIPPED)
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
must(programs / "pbm-sample", "-q", "--vertices", "20000", "-o", work / "scan.ply")
must(programs / "pbm-build", "-q", work / "scan.ply", "-o", work / "scan.pbvg")

CHANNELS = {name: "half" for name in "RGBA"} | {name: "float" for name in ("Z", "P.X", "P.Y", "P.Z", "N.X", "N.Y", "N.Z")} | {
    name: "uint" for name in ("level.X", "material.X", "point.X")}
CAMERA = ["--camera-position=0,0,0.34", "--camera-focal-point=0,0,0", "--camera-view-up=0,1,0"]


def srgb(light):
    light = min(max(light, 0), 1)
    return 255 * (12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055)


def read_pixels(path):
    """The names of the channels, and the values of each pixel, top row first, as oiiotool prints them."""
    values, names = {}, []
    for line in must("oiiotool", "--info", "-v", "--dumpdata", path).splitlines():
        if found := re.search(r"channel list: (.*)", line):
            names = re.findall(r"([\w.]+) \(\w+\)", found[1])
        if found := re.match(r"\s*Pixel \((\d+), (\d+)\): (.*)", line):
            values[int(found[2]), int(found[1])] = [float(number) for number in found[3].split()]
    return names, [values[y, x] for y in range(HEIGHT) for x in range(WIDTH)]


def read_depths(path):
    words = path.read_bytes().split(b"\n", 3)
    rows = array.array("f", words[3])
    return [rows[y * WIDTH + x] for y in reversed(range(HEIGHT)) for x in range(WIDTH)]


for quality in ("fast", "fine"):
    exr, png, pfm = (work / f"{quality}.{kind}" for kind in ("exr", "png", "pfm"))
    common = [programs / "pbm-render", work / "scan.pbvg", "-q", f"--resolution={WIDTH},{HEIGHT}", f"--quality={quality}", *CAMERA]
    must(*common, "-o", exr, "--exposure=3")  # which is for other pictures
    must(*common, "-o", png, "--no-background", "--depth-output", pfm)
    info = subprocess.run(["exrinfo", "-v", exr], capture_output=True, text=True).stdout  # exits with any code
    listed = dict(re.findall(r"'([\w.]+)': (\w+) samp 1 1", info))
    check(listed == CHANNELS, f"exrinfo lists {listed}")
    check("scanlineimage" in info and "'zip'" in info and f"{WIDTH} x {HEIGHT}" in info, f"exrinfo: {info}")
    names, pixels = read_pixels(exr)
    check(sorted(names) == sorted(CHANNELS) and names[:4] == list("RGBA"), f"oiiotool lists {names}")
    at = {name: names.index(name) for name in names}
    width, height, channels, flat = pictures.read_png(png)
    check((width, height, channels) == (WIDTH, HEIGHT, 4), f"{png.name} is {width} x {height}, {channels} channels")
    depths, shown, partial = read_depths(pfm), 0, 0
    for index, values in enumerate(pixels):
        red, green, blue, alpha = values[:4]
        drawn = flat[4 * index:4 * index + 4]
        check(abs(255 * alpha - drawn[3]) < 0.7, f"{quality}: alpha of pixel {index} is {alpha}, {drawn[3]} in the PNG")
        partial += 0 < drawn[3] < 255
        for light, byte in zip((red, green, blue), drawn):
            check(alpha == 0 or abs(srgb(light / alpha) - byte) < 1.5, f"{quality}: pixel {index}: {values[:4]} and {list(drawn)}")
        depth, normal = values[at["Z"]], [values[at[f"N.{axis}"]] for axis in "XYZ"]
        if quality == "fast":  # fine ones have soft edges: some of their pixels are covered beside their middle alone
            check((depth == 1e10) == (depths[index] == float("inf")), f"pixel {index}: {depth}, {depths[index]} in the PFM")
            check(depth == 1e10 or abs(depth - depths[index]) < 1e-5 * depth, f"depth {depth}, {depths[index]} in the PFM")
        check((depth == 1e10) == (values[at["point.X"]] == 0), f"{quality}: pixel {index} has {values}")
        if depth == 1e10:
            check(normal == [0, 0, 0], f"{quality}: pixel {index} shows nothing, and has {values}")
            continue
        shown += 1
        check(abs(values[at["P.Z"]] - (0.34 - depth)) < 1e-6, f"{quality}: position {values} of depth {depth}")
        check(abs(sum(x * x for x in normal) - 1) < 1e-5, f"{quality}: the normal {normal} has another length")
    check(shown > 200, f"{quality}: {shown} pixels show the scan")
    check((partial > 0) == (quality == "fine"), f"{quality}: {partial} pixels are covered in part")
print("colours, depths, positions and normals are read as they were written")
