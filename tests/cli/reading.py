#!/usr/bin/env python3
"""pbm-render reads and decodes only what its picture needs: reading.py PROGRAMS WORK_FOLDER"""

import json
import pathlib
import random
import shutil
import subprocess
import sys

programs, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def run(program, *arguments, code=0):
    command = [str(programs / program), *map(str, arguments)]
    result = subprocess.run(command, cwd=work, capture_output=True, text=True, timeout=300)
    if result.returncode != code:
        sys.exit(f"FAILED with {result.returncode}: {' '.join(command)}\n{result.stdout}{result.stderr}")
    return result


def check(condition, message):
    if not condition:
        sys.exit("FAILED: " + message)


def same(a, b):
    check((work / a).read_bytes() == (work / b).read_bytes(), f"{a} and {b} differ")


def draw(model, picture, *options):
    run("pbm-render", "-q", model, "-o", picture, "--quality=fast", "--json=drawn.json", *options)
    return json.loads((work / "drawn.json").read_text())


run("pbm-sample", "--vertices", 20000, "-q", "-o", "scan.ply")
DEPTH = 10
BYTES_PER_POINT = {565: 4, 888: 5}
for colour in BYTES_PER_POINT:
    for store in ("packed", "mapped"):
        run("pbm-build", "-q", "--depth", DEPTH, "--colour", colour, "--store", store, "scan.ply", "-o",
            f"{store}{colour}.pbvg")

# A coarse first picture needs few bytes per point, and little more than the start of the file.
for colour, most in BYTES_PER_POINT.items():
    shown_of_64_kb = 0
    for level in range(5, DEPTH):
        drawn = draw(f"packed{colour}.pbvg", "first.png", "--level", level, "--max-error", 0.1)
        check(drawn["level"] == level, f"level {level}: drew {drawn['level']}")
        if level < 6 and drawn["bytes_read"] > 4096:
            continue  # choosing the camera reads level 6
        per_point = drawn["bytes_read"] / drawn["points"]
        check(per_point <= most, f"level {level} of {colour}: {per_point:.2f} bytes read per point shown")
        if drawn["bytes_read"] <= 65536:
            shown_of_64_kb = drawn["points"]
    check(shown_of_64_kb >= 4000, f"{colour}: {shown_of_64_kb} points from 64 KB")

# Packed and mapped files give the same picture; a mapped file is not decoded.
views = {
    "whole": [],
    "coarse": ["--max-error", 8],
    "fine": ["--max-error", 0.3, "--resolution", "2000,2000"],
    "close": ["--camera-position", "0.02,-0.03,0.39", "--camera-view-angle", 1],
    "corner": ["--camera-position", "0.05,0.02,0.12", "--camera-focal-point", "0.05,0,0", "--camera-view-angle", 8],
}
costs = {}
for name, options in views.items():
    packed = draw("packed888.pbvg", "packed.png", *options)
    mapped = draw("mapped888.pbvg", "mapped.png", *options)
    same("packed.png", "mapped.png")
    draw("packed888.pbvg", "again.png", "-j", 1, *options)
    same("packed.png", "again.png")
    check(mapped["points_decoded"] == 0 < packed["points_decoded"], f"{name}: decoded {mapped['points_decoded']}")
    check(packed["points"] == mapped["points"] and packed["level"] == mapped["level"], f"{name}: {packed} {mapped}")
    check(packed["bytes_read"] <= packed["file_bytes"], f"{name}: read more than there is")
    costs[name] = packed
check(costs["coarse"]["points_decoded"] < costs["whole"]["points_decoded"] < costs["fine"]["points_decoded"],
      "finer pictures decode no more")
total = json.loads(run("pbm-info", "--json", "packed888.pbvg").stdout)["points"]
for name in ("close", "corner"):
    check(costs[name]["level"] == DEPTH, f"{name} is no close-up: level {costs[name]['level']}")
    decoded = costs[name]["points_decoded"]
    check(decoded <= total / 4, f"{name}: {decoded} of {total} points decoded")

# The output of -v states the same figures.
said = run("pbm-render", "-v", "--quality", "fast", "packed888.pbvg", "-o", "words.png").stdout
words = f"read: {costs['whole']['bytes_read']} of {costs['whole']['file_bytes']} bytes, " \
        f"{costs['whole']['points_decoded']} points decoded\n"
check(words in said, f"-v says: {said}")

# Damage outside the chunks that a picture needs is not noticed; damage inside prevents the picture.
damaged = bytearray((work / "packed888.pbvg").read_bytes())
damaged[-1000] ^= 1
(work / "damaged.pbvg").write_bytes(damaged)
draw("damaged.pbvg", "coarse.png", "--max-error", 8)
draw("packed888.pbvg", "packed.png", "--max-error", 8)
same("coarse.png", "packed.png")
refused = run("pbm-render", "damaged.pbvg", "-o", "refused.png", "--max-error", 0.1, code=3)
check("damaged.pbvg" in refused.stderr and "offset" in refused.stderr, f"damage is not named: {refused.stderr}")
check(not (work / "refused.png").exists(), "a picture of a damaged chunk")

# --max-memory limits the memory.
refused = run("pbm-render", "packed888.pbvg", "-o", "refused.png", "--max-error", 0.1, "--resolution", "320,200",
              "--max-memory", "2M", code=4)
check("--max-memory" in refused.stderr, refused.stderr)

# --bench measures frames from views around the model and writes no pictures.
for renderer in ("fast", "reference"):
    run("pbm-render", "packed888.pbvg", "--bench", 5, "--json=bench.json", "-q", "--renderer", renderer, "--level", 8)
    bench = json.loads((work / "bench.json").read_text())
    check(bench["renderer"] == renderer and bench["bench_frames"] == 5, f"{bench}")
    check(0 < bench["bench_min_ms"] <= bench["bench_median_ms"], f"{bench}")
    check(bench["bench_drawn_points"] > 10000 and bench["peak_memory"] > 1 << 20, f"{bench}")
# A mapped file that is overwritten while it is drawn gives wrong pixels at worst. The program has read the directories
# before the first frame.
victim = bytearray((work / "mapped888.pbvg").read_bytes())
(work / "written.pbvg").write_bytes(victim)
directory_end = len(victim) // 4
bench = subprocess.Popen([str(programs / "pbm-render"), "written.pbvg", "--bench", "300", "--resolution", "320,200", "-q"],
                         cwd=work, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
random_bytes = random.Random(1)
with open(work / "written.pbvg", "r+b", buffering=0) as file:
    while bench.poll() is None:
        file.seek(random_bytes.randrange(directory_end, len(victim) - 4096))
        file.write(random_bytes.choice([random_bytes.randbytes(4096), bytes(4096), b"\xff" * 4096]))
output = "".join(bench.communicate())
check(bench.returncode in (0, 3), f"{bench.returncode} from a file that is written to: {output}")
check(bench.returncode == 0 or "offset" in output, output)

print("first pictures:", {name: f"{cost['bytes_read']} bytes, {cost['points_decoded']} of {total} points decoded"
                          for name, cost in costs.items()})
