#!/usr/bin/env python3
"""Presets of pbm-render: each is a set of options, and options that are given win: presets.py PROGRAMS WORK_FOLDER"""

import math
import pathlib
import re
import shutil
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import pictures  # noqa: E402
from commands import check, must  # noqa: E402

programs, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
must(programs / "pbm-sample", "-q", "--vertices", "20000", "-o", work / "scan.ply")
must(programs / "pbm-build", "-q", "--unit", "m", "--depth", "7", work / "scan.ply", "-o", work / "scan.pbvg")


def render(*arguments):
    result = subprocess.run([programs / "pbm-render", *map(str, arguments)], cwd=work, capture_output=True, text=True, timeout=300)
    check(result.returncode == 0, f"{arguments}: {result.returncode} {result.stderr}")
    return result


def options_of(text):
    return re.search(r"^view: (.*)", text, re.MULTILINE)[1].split()


def check_sets_of_options():
    size = ["--resolution=180,240", "--samples=2"]
    for preset in ("plate", "hero", "clay", "raking", "raking,30"):
        options = options_of(render("scan.pbvg", f"--preset={preset}", *size, "-o", "a.png", "-v").stdout)
        render("scan.pbvg", *options, "-o", "b.png")
        check((work / "a.png").read_bytes() == (work / "b.png").read_bytes(), f"{preset} is not the picture of {options}")
        given = ["--background-color=1,0,0", "--exposure=0", "--tone=none", "--no-drop-shadow", "--no-scale-bar", "--headlight=0,0",
                 "--depth-cue=none", "--projection=perspective"]
        taken = options_of(render("scan.pbvg", *given, f"--preset={preset}", *size, "-o", "a.png", "-v").stdout)
        for option in ("--background-color=1,0,0", "--headlight=0,0", "--depth-cue=none"):
            check(option in taken, f"{preset} and {given}: {taken}")
        check(not [word for word in taken if re.match("--(exposure|tone|drop-shadow|scale-bar|projection)", word)],
              f"{preset} and {given}: {taken}")
    wrong = subprocess.run([programs / "pbm-render", "scan.pbvg", "--preset=raking,80", "-o", "c.png"], cwd=work,
                           capture_output=True, text=True)
    check(wrong.returncode == 1 and "1 to 60 degrees" in wrong.stderr, wrong.stderr)


def check_raking():
    for angle in (5, 15, 40):
        options = options_of(render("scan.pbvg", f"--preset=raking,{angle}", "--resolution=60,80", "-o", "a.png", "-v").stdout)
        right, up = (math.radians(float(x)) for x in next(o for o in options if o.startswith("--headlight="))[12:].split(","))
        light = (math.cos(up) * math.sin(right), math.sin(up), math.cos(up) * math.cos(right))
        check(abs(math.degrees(math.asin(light[2])) - angle) < 1e-6, f"raking,{angle}: light from {light}")
        check(light[0] < 0 < light[1] and abs(light[0] + light[1]) < 1e-9, f"raking,{angle}: light from {light}")


def check_plate():
    text = render("scan.pbvg", "--preset=plate", "--resolution=900,1200", "--quality=fast", "-o", "plate.png", "-v").stdout
    data = (work / "plate.png").read_bytes()
    at = data.index(b"pHYs") + 4
    check(struct.unpack(">IIB", data[at:at + 9]) == (11811, 11811, 1), "300 dots an inch are 11811 a metre")
    width, height, channels, flat = pictures.read_png(work / "plate.png")
    check((width, height, channels) == (900, 1200, 3), f"the plate is {width} x {height}, {channels} channels")
    pixel = lambda x, y: flat[3 * (y * width + x)]  # noqa: E731
    check(all(pixel(x, y) == 255 for x, y in ((0, 0), (width - 1, 0), (width - 1, height - 1))), "corners are not white")
    options = dict(word[2:].split("=") for word in options_of(text) if "=" in word)
    eye, focus = ([float(x) for x in options[f"camera-{name}"].split(",")] for name in ("position", "focal-point"))
    seen = 2 * math.dist(eye, focus) * math.tan(math.radians(float(options["camera-view-angle"]) / 2))
    longest = max(len(run) for y in range(1000, height) for run in re.findall(rb"\0+", bytes(flat[3 * y * width:3 * (y + 1) * width:3])))
    length = longest * seen / height
    mantissa = length / 10 ** math.floor(math.log10(length * 1.001))
    check(min(abs(mantissa - nice) for nice in (1, 2, 5)) < 0.02, f"the scale bar of {longest} pixels is {length} m long")
    render("scan.pbvg", "--preset=plate", "--resolution=90,120", "-o", "plate.jpg")
    check((work / "plate.jpg").read_bytes()[6:18] == b"JFIF\0\1\1\1\1\x2c\1\x2c", "the JPEG has no 300 dots an inch")
    render("scan.pbvg", "--preset=plate", "--resolution=90,120", "--dpi=600", "-o", "plate.bmp")
    check(struct.unpack("<II", (work / "plate.bmp").read_bytes()[38:46]) == (23622, 23622), "the BMP has no 600 dots an inch")
    # The shadow: darker than white, and gone without the option.
    for more, is_there in ((["--no-scale-bar"], True), (["--no-scale-bar", "--no-drop-shadow"], False)):
        render("scan.pbvg", "--preset=plate", "--resolution=300,400", "--quality=fast", "--background-color=1,1,1",
               "--shading=unlit", *more, "-o", "s.png")
        render("scan.pbvg", *options_of(render("scan.pbvg", "--preset=plate", "--resolution=300,400", "--quality=fast", *more, "-o",
                                               "x.png", "-v").stdout), "--no-background", "--no-drop-shadow", "-o", "alpha.png")
        shown, mask = pictures.read_png(work / "s.png")[3], pictures.read_png(work / "alpha.png")[3]
        beside = [shown[3 * i] for i in range(300 * 400) if mask[4 * i + 3] == 0]
        check((min(beside) < 235) == is_there, f"{more}: the darkest pixel beside the model is {min(beside)}")


def check_hero():
    result = render("scan.pbvg", "--preset=hero", "--resolution=60,80", "-o", "a.png")
    check("the model has no panorama or no ground" in result.stderr, result.stderr)
    render("scan.ply", "-q", "--preset=hero", "--cache=none", "--resolution=60,80", "-o", "hero.png")
    check((work / "a.png").read_bytes() != (work / "hero.png").read_bytes(), "the scan has no surroundings")


check_sets_of_options()
check_raking()
check_plate()
check_hero()
print("presets are sets of options")
