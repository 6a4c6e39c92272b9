#!/usr/bin/env python3
"""Draws models and scans from six sides with default options: a row a model, some rows a picture. For looking at.
usage: contact_sheet.py BIN SHEET.png [--near] [--edge PIXELS] [--rows N] MODEL... [-- OPTIONS of pbm-render]

Of more than N models (6), the sheets are SHEET-1.png, SHEET-2.png, ... --near adds a row for each model from two fifths
of the distance. A model that cannot be drawn gets a line on standard output instead of a row; the exit code is 1 then.
Needs ImageMagick."""
import argparse
import math
import pathlib
import subprocess
import sys
import tempfile

AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
NEAR = 0.4


class Failed(Exception):
    pass


def plus(a, b, factor=1.0):
    return tuple(p + factor * q for p, q in zip(a, b))


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def scaled(a, length):
    return plus((0, 0, 0), a, length / math.sqrt(dot(a, a)))


def render(programs, model, options):
    done = subprocess.run([programs / "pbm-render", *options, "--", model], capture_output=True, text=True,
                          errors="replace")
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        raise Failed(lines[-1])
    return done.stdout


def camera(said, line):
    """Position, focal point and view-up of the camera in a line of `pbm-render -v`."""
    words = next(each for each in said.splitlines() if each.startswith(line)).split()
    values = dict(word[2:].split("=", 1) for word in words if word.startswith("--camera") and "=" in word)
    return [tuple(map(float, values[f"camera-{name}"].split(","))) for name in ("position", "focal-point", "view-up")]


def cameras(programs, model, options, scratch):
    """For six sides: direction from the centre to the eye, up, and a distance that shows all; and the centre.

    A turn about an axis looks at a point of the line along that axis through the centre, and shows all of the model from
    the four sides around that line."""
    small = ["--resolution=64,64", "-v"]
    eye, focus, up = camera(render(programs, model, [*options, *small, "-o", scratch / "first.png"]), "view:")
    turns = {axis: camera(render(programs, model, [*options, *small, f"--up={axis}", "--frames=1",
                                                   f"--turntable={scratch}/turn_%d.png"]), "frame 1:") for axis in AXES}
    centre = (turns["y"][1][0], turns["x"][1][1], turns["x"][1][2])
    towards = plus(eye, focus, -1)
    front = scaled(plus(towards, up, -dot(towards, up)), 1)
    right = cross(up, front)

    def far(direction):
        return 1.1 * min(math.dist(eye, centre) for axis, (eye, _, _) in turns.items()
                         if abs(dot(AXES[axis], direction)) < 0.7)

    sides = {"front": (front, up), "back": (scaled(front, -1), up), "left": (scaled(right, -1), up),
             "right": (right, up), "top": (up, scaled(front, -1)), "bottom": (scaled(up, -1), front)}
    return {name: (direction, above, far(direction)) for name, (direction, above) in sides.items()}, centre


def draw(programs, model, name, arguments, scratch):
    """The arguments of montage for the rows of a model."""
    cells = []
    sides, centre = cameras(programs, model, arguments.options, scratch)
    for factor in (1, NEAR) if arguments.near else (1,):
        for side, (direction, up, distance) in sides.items():
            picture = scratch / f"{len(list(scratch.iterdir()))}_{side}.png"
            vectors = {"position": plus(centre, direction, factor * distance), "focal-point": centre, "view-up": up}
            render(programs, model, [f"--resolution={arguments.edge},{arguments.edge}", "-q", "-o", picture,
                                     *(f"--camera-{what}={','.join(map(repr, v))}" for what, v in vectors.items()),
                                     *arguments.options])
            label = f"{name}, {side}" if side == "front" else side
            cells += ["-label", label.replace("\\", "\\\\").replace("%", "%%"), picture]
    return cells


def name_of(model):
    return "/".join(pathlib.Path(model).parts[-2:])[-26:]  # what fits under a cell


def parse():
    mine, options = sys.argv[1:], []
    if "--" in mine:
        cut = mine.index("--")
        mine, options = mine[:cut], mine[cut + 1:]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("sheet", type=pathlib.Path)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--near", action="store_true")
    parser.add_argument("--edge", type=int, default=240)
    parser.add_argument("--rows", type=int, default=6)
    arguments = parser.parse_intermixed_args(mine)
    arguments.options = options
    return arguments


def main():
    arguments = parse()
    failed = False
    parts = [arguments.models[at:at + arguments.rows] for at in range(0, len(arguments.models), arguments.rows)]
    for number, part in enumerate(parts, 1):
        with tempfile.TemporaryDirectory() as folder:
            scratch, cells = pathlib.Path(folder), []
            for model in part:
                try:
                    cells += draw(arguments.bin, model, name_of(model), arguments, scratch)
                except Failed as failure:
                    failed = True
                    print(f"{model}: not drawn: {failure}", flush=True)
            sheet = arguments.sheet
            if len(parts) > 1:
                sheet = sheet.with_stem(f"{sheet.stem}-{number}")
            if cells:
                subprocess.run(["montage", "-font", "DejaVu-Sans", "-background", "white", *cells, "-tile", "6x",
                                "-geometry", "+2+2", sheet], check=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
