#!/usr/bin/env python3
"""Instructions of one frame of each renderer, and of offsets, counted by callgrind: the same on every run.

  instructions.py BIN MODEL.pbvg [OPTION...]   prints what a frame costs, whole and per point
  instructions.py BIN --check COMPILER        is no frame of the sample dearer than tests/instructions/expected.csv?
  instructions.py BIN --update COMPILER       writes that table anew: after a change that is meant to cost more

OPTION: of pbm-render. COMPILER: what BIN was built with, like "GNU 12.2.0"; another one makes other code, so that nothing
is compared then. One thread, AVX2: valgrind knows nothing wider. Exit code 1: a frame is dearer, 77: nothing could be
compared.
"""
import argparse
import csv
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

EXPECTED = pathlib.Path(__file__).resolve().parent.parent / "tests" / "instructions" / "expected.csv"
# What is counted: pbm-render's renderer, and the functions at whose entry and exit counting begins or ends. Bands of the
# PNG are encoded while the rest is drawn, and offsets that no loading thread has estimated are estimated within the
# first frame that needs them; neither is part of a frame. What is subtracted: such a function.
COUNTED = {"fast": ("fast", ["FastRenderer::render*", "PngBands::encode*"], "SurfaceOffsets::estimate"),
           "offsets": ("fast", ["SurfaceOffsets::estimate*"], None),
           "reference": ("reference", ["TableRenderer::render*"], None)}
VIEWS = {"whole": [],  # splats of a pixel or two
         "coarse": ["--level", "6"],  # of a dozen pixels, and what a picture costs without any
         "dense": ["--resolution", "640,360", "--max-error", "0.5"]}  # more points than pixels
TOLERANCE = 1.02  # other C libraries may cost so much more: a loop of a fifth of a frame that gets 10 % slower fails


def instructions_within(function, counts):
    """Instructions of a function and all that it calls, in a file of callgrind."""
    listed = subprocess.run(["callgrind_annotate", "--inclusive=yes", "--threshold=100", counts], capture_output=True,
                            text=True, check=True).stdout
    return sum(int(line.split()[0].replace(",", "")) for line in listed.splitlines() if f":pbm::{function}(" in line)


def count(program, what, model, options):
    """Instructions of what is COUNTED in a picture, and pbm-render's statistics."""
    renderer, toggles, subtracted = COUNTED[what]
    with tempfile.TemporaryDirectory() as name:
        command = ["valgrind", "--tool=callgrind", "--collect-atstart=no",
                   *[f"--toggle-collect=pbm::{function}" for function in toggles],
                   f"--callgrind-out-file={name}/out", program, model,
                   "-o", f"{name}/picture.png", "-j", "1", "--json", "--quality", "fast", "--renderer", renderer, *options]
        run = subprocess.run(command, capture_output=True, text=True)
        if run.returncode != 0:
            sys.exit(f"{' '.join(map(str, command))}: exit code {run.returncode}\n{run.stderr[-2000:]}")
        apart = instructions_within(subtracted, f"{name}/out") if subtracted else 0
    collected = next(line for line in run.stderr.splitlines() if "Collected" in line)
    return int(collected.split(":")[1]) - apart, json.loads(run.stdout[run.stdout.index("{"):])


def print_frames(program, model, options):
    for what in COUNTED:
        instructions, statistics = count(program, what, model, options)
        points, drawn = statistics["points"], statistics["drawn_points"]
        print(f"{what}: {instructions:,} instructions, {points:,} points: {instructions / points:.1f} per point, "
              f"{instructions / drawn:.1f} per point drawn ({drawn:,})", flush=True)


def sample(programs, folder):
    """The model that frames are counted on, made anew: 0.8 M points."""
    scan, model = folder / "sample.ply", folder / "sample.pbvg"
    for command in (["pbm-sample", "--vertices", "20000", "-o", scan], ["pbm-build", scan, "--depth", "9", "-o", model]):
        subprocess.run([programs / command[0], "-q", *command[1:]], check=True)
    return model


def frames_of_sample(programs):
    with tempfile.TemporaryDirectory() as folder:
        model = sample(programs, pathlib.Path(folder))
        for what in COUNTED:
            for view, options in VIEWS.items():
                instructions, statistics = count(programs / "pbm-render", what, model, options)
                yield {"counted": what, "view": view, "instructions": instructions,
                       "drawn_points": statistics["drawn_points"]}


def update(programs, compiler):
    EXPECTED.parent.mkdir(exist_ok=True)
    rows = list(frames_of_sample(programs))
    with open(EXPECTED, "w", newline="") as file:
        file.write(f"# instructions of one frame of the sample; written by bench/instructions.py --update, {compiler}\n")
        table = csv.DictWriter(file, rows[0], lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    print(f"{EXPECTED}: {len(rows)} rows")
    return 0


def why_not(compiler):
    """Why nothing can be compared, or None."""
    if not shutil.which("valgrind"):
        return "valgrind is not installed"
    information = pathlib.Path("/proc/cpuinfo")
    if not information.exists() or not re.search(r"\bavx2\b", information.read_text()):
        return "this processor has no AVX2"
    with open(EXPECTED) as file:
        expected = file.readline().strip().rsplit(", ")[-1]
    major = lambda name: name.split(".")[0]
    return None if major(compiler) == major(expected) else f"the counts are those of {expected}, not of {compiler}"


def check(programs, compiler):
    if problem := why_not(compiler):
        print(f"skipped: {problem}")
        return 77
    with open(EXPECTED, newline="") as file:
        file.readline()
        expected = {(row["counted"], row["view"]): row for row in csv.DictReader(file)}
    dearer = 0
    for frame in frames_of_sample(programs):
        was = expected[frame["counted"], frame["view"]]
        ratio = frame["instructions"] / int(was["instructions"])
        dearer += ratio > TOLERANCE
        print(f"{frame['counted']}, {frame['view']}: {frame['instructions']:,} instructions, {ratio:.3f} of what is "
              f"expected; {frame['instructions'] / frame['drawn_points']:.1f} per point drawn ({frame['drawn_points']:,}, "
              f"expected {int(was['drawn_points']):,}){'  DEARER' if ratio > TOLERANCE else ''}", flush=True)
    if dearer:
        print(f"If frames are meant to cost more: bench/instructions.py {programs} --update '{compiler}', and say in the "
              "commit why they do.")
    return 1 if dearer else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin", type=pathlib.Path, metavar="BIN", help="folder of built programs")
    parser.add_argument("model", nargs="?", metavar="MODEL.pbvg", help="model to draw")
    parser.add_argument("--check", metavar="COMPILER", help="compare the sample's frames with the table")
    parser.add_argument("--update", metavar="COMPILER", help="write the table")
    arguments, options = parser.parse_known_args()
    programs = arguments.bin.resolve()
    if arguments.check:
        return check(programs, arguments.check)
    if arguments.update:
        return update(programs, arguments.update)
    if not arguments.model:
        parser.error("name a model, or --check or --update")
    print_frames(programs / "pbm-render", arguments.model, options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
