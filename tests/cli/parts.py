#!/usr/bin/env python3
"""One model in parts (--shard, --merge, --plan): the bytes of one build, and what is refused: parts.py PROGRAMS WORK_FOLDER

A row per build: options, parts, points of each part."""

import json
import os
import pathlib
import random
import shutil
import subprocess
import sys

PROGRAMS, FOLDER = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
failed = []


def check(condition, message):
    if not condition:
        failed.append(message)
    return condition


def run(*command):
    """Exit code and what was said."""
    done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.returncode, done.stdout


def build(*arguments):
    return run(PROGRAMS / "pbm-build", *arguments)


def must(*arguments):
    code, said = build(*arguments)
    check(code == 0, f"{arguments}: {code} {said}")


def part(model, index, count):
    return pathlib.Path(f"{model}.part-{index}-of-{count}")


def build_parts(arguments, model, count, threads=lambda index: 1 + index % 3):
    """Returns the points of each part."""
    points = []
    for index in range(count):
        must(*arguments, "-q", "-o", model, "--shard", f"{index}/{count}", "-j", threads(index), "--json=part.json")
        points.append(json.loads(pathlib.Path("part.json").read_text())["points"])
    return points


def write_cloud(name, points, columns, row):
    rows = [row(i) for i in range(points)]
    pathlib.Path(name).write_text("\n".join(["# " + columns, *rows, ""]))


def make_inputs():
    for name, more in (("mesh.ply", ["--vertices", 20000]), ("other.ply", ["--vertices", 10000, "--seed", 9])):
        subprocess.run([PROGRAMS / "pbm-sample", "-q", *map(str, more), "-o", name], check=True)
    # The vertices of the mesh as clouds, of which one has normals and measurements.
    must("mesh.ply", "-q", "--depth", 7, "-o", "mesh.pbvg")
    subprocess.run([PROGRAMS / "pbm-export", "-q", "mesh.pbvg", "-o", "cloud.ply"], check=True)
    rng = random.Random(3)
    write_cloud("cloud.xyz", 20000, "x y z intensity class",
                lambda i: f"{i % 141 / 10} {i // 141 / 10} {rng.random() / 20} {i % 997} {i // 700 % 30}")  # fmt: skip
    # An open sheet of hills, whose splats end at its border.
    corners = [f"v {x / 40} {(x * y % 7) / 100} {y / 40}" for x in range(41) for y in range(41)]
    quads = [f"f {a} {a + 1} {a + 42} {a + 41}" for a in range(1, 40 * 41) if a % 41]
    pathlib.Path("sheet.obj").write_text("\n".join([*corners, *quads, ""]))
    # A large quad and a fine ribbon: a part has few voxels and most of the border.
    corners = ["v 0 0 0", "v 1 0 0", "v 1 1 0", "v 0 1 0"]
    corners += [f"v {0.1 + 0.0002 * (i // 2)} {0.5 + 0.05 * (i % 2)} 0.3" for i in range(802)]
    quads = ["f 1 2 3 4", *(f"f {a} {a + 2} {a + 3} {a + 1}" for a in range(5, 805, 2))]
    pathlib.Path("uneven.obj").write_text("\n".join([*corners, *quads, ""]))
    pathlib.Path("few.xyz").write_text("".join(f"{x} 0 0\n" for x in range(3)))


CASES = (
    (["mesh.ply"], [], 4),
    (["sheet.obj"], [], 3),
    (["uneven.obj"], [], 2),
    (["mesh.ply"], ["--voxel-size", "0.005"], 3),
    (["mesh.ply"], ["--depth", "7", "--lights", "studio", "--shadows", "--ground", "wood"], 3),
    (["mesh.ply"], ["--depth", "7", "--texture", "marble", "--panorama", "default"], 3),
    (["mesh.ply"], ["--depth", "7", "--source-hash", "--name", "a mesh"], 2),
    (["mesh.ply", "other.ply"], ["--depth", "7", "--lights", "studio", "--shadows"], 3),
    (["mesh.ply", "cloud.ply"], ["--depth", "7"], 3),
    (["cloud.ply"], ["--lights", "studio", "--shadows"], 3),
    (["cloud.xyz"], ["--columns", "x,y,z,intensity,class"], 3),
    (["cloud.xyz"], ["--columns", "x,y,z,intensity,class", "--field", "intensity,16", "--field",
                     "class,majority,8"], 3),
    (["cloud.xyz"], ["--columns", "x,y,z,intensity,class", "--upsample", "4", "--depth", "9"], 4),
    (["few.xyz"], ["--depth", "7"], 9),
    (["mesh.ply"], ["--max-memory", "20M"], 3),
)  # fmt: skip


def check_bytes():
    for inputs, options, count in CASES:
        must(*inputs, *options, "-q", "-j", 2, "-o", "whole.pbvg")
        points = build_parts([*inputs, *options], "parts.pbvg", count)
        must(*inputs, *options, "-q", "-o", "parts.pbvg", "--merge", count)
        print(*inputs, *options, count, points, flush=True)
        same = pathlib.Path("whole.pbvg").read_bytes() == pathlib.Path("parts.pbvg").read_bytes()
        check(same, f"{inputs} {options} in {count} parts: other bytes")
        if inputs == ["few.xyz"]:
            check(points.count(0) >= count - 3, f"no part is empty: {points}")
        elif inputs != ["uneven.obj"]:
            check(min(points) > 0 and max(points) < sum(points) * 0.9, f"{inputs} {options}: unequal parts {points}")


def refused(code, text, *arguments):
    said = build(*arguments)
    check(said[0] == code and text in said[1] and said[1].count("\n") == 1, f"{arguments}: {said}, not {code} {text}")


def check_keeping():
    """Of what is there a part is kept if it is whole and of the same build."""
    arguments = ["mesh.ply", "--depth", "7"]
    build_parts(arguments, "kept.pbvg", 3)
    whole = [part("kept.pbvg", i, 3).read_bytes() for i in range(3)]
    for i in range(3):
        os.utime(part("kept.pbvg", i, 3), ns=(10**18, 10**18))
    code, said = build(*arguments, "-o", "kept.pbvg", "--shard", "1/3")
    check(code == 0 and "up to date" in said and "depth 7" in said and " 0 points" not in said, f"kept: {code} {said}")
    check(part("kept.pbvg", 1, 3).stat().st_mtime_ns == 10**18, "a part that is there was built again")

    def spoilt(spoil):
        for i in range(3):
            part("kept.pbvg", i, 3).write_bytes(spoil(whole[i]))

    def rebuilt(what):
        for i in range(3):
            must(*arguments, "-q", "-o", "kept.pbvg", "--shard", f"{i}/3")
            check(part("kept.pbvg", i, 3).read_bytes() == whole[i], f"{what}: part {i} was not built again")

    merge = [*arguments, "-q", "-o", "kept.pbvg", "--merge", 3]
    pathlib.Path("kept.pbvg").write_text("old")
    for what, spoil in (("cut", lambda file: file[: len(file) // 2]), ("empty", lambda file: b""),
                        ("a bit", lambda file: file[:700] + bytes([file[700] ^ 4]) + file[701:]),
                        ("longer", lambda file: file + b"\0")):  # fmt: skip
        spoilt(spoil)
        refused(3, "kept.pbvg.part-0-of-3: this part is damaged", *merge)
        rebuilt(what)

    part("kept.pbvg", 2, 3).unlink()
    refused(2, "kept.pbvg.part-2-of-3: cannot open", *merge)
    must(*arguments, "-q", "-o", "kept.pbvg", "--shard", "2/3")
    another = "kept.pbvg.part-0-of-3: this part belongs to another build"
    refused(3, another, "mesh.ply", "--depth", "6", "-q", "-o", "kept.pbvg", "--merge", 3)
    refused(3, another, "other.ply", "--depth", "7", "-q", "-o", "kept.pbvg", "--merge", 3)
    # Not all parts are of one build.
    must("mesh.ply", "--depth", "6", "-q", "-o", "kept.pbvg", "--shard", "1/3")
    refused(3, "kept.pbvg.part-1-of-3: this part belongs to another build", *merge)
    must(*arguments, "-q", "-o", "kept.pbvg", "--shard", "1/3")
    # Renamed parts.
    for i in range(2):
        shutil.copy(part("kept.pbvg", i, 3), part("kept.pbvg", i, 2))
    refused(3, "kept.pbvg.part-0-of-2: this part belongs to another build", *arguments, "-o", "kept.pbvg", "--merge", 2)
    part("kept.pbvg", 0, 3).write_bytes(whole[1])
    refused(3, "kept.pbvg.part-0-of-3: this is another part than its name says", *merge)
    check(pathlib.Path("kept.pbvg").read_text() == "old", "a refused merge touched the model")
    rebuilt("another part")
    must(*merge)

    # The scan is gone, or an input of the merge's shadows.
    refused(2, "gone.ply: cannot open", "gone.ply", "-q", "-o", "gone.pbvg", "--shard", "0/2")
    check(not part("gone.pbvg", 0, 2).exists(), "a part without a scan")


def check_usage():
    usage = [
        ("--max-points", ["mesh.ply", "--max-points", 1000, "-o", "x.pbvg", "--shard", "0/2"]),
        ("--max-points", ["mesh.ply", "--max-points", 1000, "-o", "x.pbvg", "--merge", "2"]),
        ("--mesh-report", ["mesh.ply", "--mesh-report", "-o", "x.pbvg", "--shard", "0/2"]),
        ("-o", ["mesh.ply", "-o", "-", "--shard", "0/2"]),
        ("-o", ["mesh.ply", "-o", "-", "--merge", "2"]),
        ("--shard", ["mesh.ply", "-o", "x.pbvg", "--merge", "2", "--shard", "0/2"]),
        ("--batch", ["mesh.ply", "-o", "x.pbvg", "--plan", "x.ninja"]),
        ("--plan", ["mesh.ply", "-o", "x.pbvg", "--shards", "2"]),
        ("--shard", ["mesh.ply", "-o", "x.pbvg", "--shards", "2", "--plan", "x.ninja", "--shard", "0/2"]),
        ("stream", ["-", "-o", "x.pbvg", "--shard", "0/2"]),
        ("stream", ["-", "-o", "x.pbvg", "--merge", "2"]),
        ("stream", ["-", "-o", "x.pbvg", "--shards", "2", "--plan", "x.ninja"]),
        ("is no shard", ["mesh.ply", "-o", "x.pbvg", "--shard", "2/2"]),
        ("at most 1000", ["mesh.ply", "-o", "x.pbvg", "--shard", "0/1001"]),
        ("1 not in range", ["mesh.ply", "-o", "x.pbvg", "--merge", "1"]),
        ("is no plan", ["mesh.ply", "-o", "x.pbvg", "--shards", "2", "--plan", "x.make"]),
        ("several lines", ["mesh.ply", "-o", "x\ny.pbvg", "--shards", "2", "--plan", "x.slurm"]),
    ]
    for text, arguments in usage:
        refused(1, text, *arguments)
    check(not list(pathlib.Path(".").glob("x*")), "a refused command left a file")


def ninja(plan):
    return run("ninja", "-f", plan)


def check_ninja(folder, scan, model):
    """A plan whose names need quoting gives the bytes of one build, and repairs what is damaged."""
    pathlib.Path(folder).mkdir()
    scan, model, plan = f"{folder}/{scan}", f"{folder}/{model}", f"{folder}/plan.ninja"
    shutil.copy("mesh.ply", scan)
    arguments = [scan, "--depth", "7", "--name", "it costs $5", "--max-memory", "1G"]
    must(*arguments, "-q", "-o", "whole.pbvg")
    whole = pathlib.Path("whole.pbvg").read_bytes()
    must(*arguments, "-o", model, "--shards", 3, "--plan", plan)
    code, said = ninja(plan)
    if not check(code == 0 and pathlib.Path(model).read_bytes() == whole, f"ninja: {code} {said}"):
        return
    times = lambda: [file.stat().st_mtime_ns for file in [pathlib.Path(model), *(part(model, i, 3) for i in range(3))]]
    built = times()
    code, said = ninja(plan)
    check(code == 0 and times() == built, f"ninja built again what was there: {said}")
    os.utime(scan)
    code, said = ninja(plan)
    check(code == 0 and times()[1:] == built[1:], f"ninja built parts of the same bytes again: {said}")

    part(model, 1, 3).unlink()
    code, said = ninja(plan)
    check(code == 0 and pathlib.Path(model).read_bytes() == whole, f"ninja without a part: {code} {said}")
    damaged = part(model, 2, 3)
    time = damaged.stat().st_mtime_ns
    good = damaged.read_bytes()
    damaged.write_bytes(good[:-9] + b"!" + good[-8:])
    os.utime(damaged, ns=(time, time))
    code, said = ninja(plan)
    check(code == 0 and damaged.read_bytes() == good, f"ninja with a damaged part: {code} {said}")
    check(pathlib.Path(model).read_bytes() == whole, f"ninja with a damaged part: {said}")

    # A shard that fails: nothing is merged.
    old = times()[0]
    pathlib.Path(scan).write_text("ply\n")
    code, said = ninja(plan)
    check(code != 0 and times()[0] == old and pathlib.Path(model).read_bytes() == whole, f"ninja, bad scan: {said}")
    check("--merge" not in said, f"ninja merged without a part: {said}")


def main():
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    os.chdir(FOLDER)
    os.environ.pop("PBM_CACHE_DIR", None)
    make_inputs()
    check_bytes()
    check_keeping()
    check_usage()
    if shutil.which("ninja"):
        check_ninja("plain", "scan.ply", "model.pbvg")
        check_ninja("with $ and spaces", "a $can of (2) {x}.ply", "a $model #1.pbvg")
    else:
        print("skipped: ninja is not installed")
    print("\n".join(failed))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
