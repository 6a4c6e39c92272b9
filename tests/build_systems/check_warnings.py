#!/usr/bin/env python3
"""Each warning of pbm-build has the name of its table; --deny refuses it and leaves the old output, --allow hides it, in
builds, parts and batches: check_warnings.py ROOT PROGRAMS WORK"""

import json
import math
import pathlib
import shutil
import struct
import subprocess
import sys
import zlib

root, programs, work = (pathlib.Path(word).resolve() for word in sys.argv[1:])
work = work / "warnings"
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
faults = []


def expect(condition, what):
    if not condition:
        faults.append(what)


def build(*words, exit_code=0):
    done = subprocess.run([programs / "pbm-build", *map(str, words)], cwd=work, capture_output=True, text=True)
    expect(done.returncode == exit_code, f"{words}: exit code {done.returncode}: {done.stderr}")
    return done


listed = {line.split()[0]: line.split()[1] for line in build("--list-warnings").stdout.splitlines()}
page = (root / "docs/reference/warnings.md").read_text()
table = build("--list-warnings=markdown").stdout
expect(page.endswith(table), "docs/reference/warnings.md is not what --list-warnings=markdown prints")
build("--list-warnings=html", exit_code=1)

def grey_png(size):
    def block(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = (b"\0" + b"\x80" * size) * size
    return (b"\x89PNG\r\n\x1a\n" + block(b"IHDR", struct.pack(">IIBBBBB", size, size, 8, 0, 0, 0, 0)) +
            block(b"IDAT", zlib.compress(rows)) + block(b"IEND", b""))


# Scans, and the names of their lines.
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
CUBE = "".join(f"v {x} {y} {z}\n" for z in (0, 1) for y in (0, 1) for x in (0, 1))
INWARDS = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
points = [f"{x} {y} {(x * 37 + y * 11) % 7 / 100}" for x in range(30) for y in range(30)]
(work / "plain.obj").write_text(SQUARE + "f 1 2 3\nf 1 3 4\n")
(work / "line.obj").write_text(SQUARE + "f 1 2 3\nf 1 3 4\nl 1 3\n")
(work / "loose.obj").write_text(SQUARE + "v 0.5 0.5 0.5\nf 1 2 3\nf 1 3 4\n")
(work / "flat.obj").write_text(SQUARE + "f 1 2 3\nf 1 3 4\nf 1 1 2\n")
(work / "image.obj").write_text("mtllib image.mtl\n" + SQUARE + "vt 0 0\nusemtl a\nf 1/1 2/1 3/1\nf 1/1 3/1 4/1\n")
(work / "image.mtl").write_text("newmtl a\nmap_Kd missing.png\n")
(work / "detailed.obj").write_text("mtllib detailed.mtl\nusemtl a\n" + SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n")
(work / "detailed.mtl").write_text("newmtl a\nmap_Kd grey.png\n")
(work / "grey.png").write_bytes(grey_png(2048))
(work / "box.obj").write_text(CUBE + INWARDS.partition("\n")[2])
(work / "inwards.obj").write_text(CUBE + INWARDS)
right = "".join("f " + " ".join(reversed(face.split()[1:])) + "\n" for face in INWARDS.splitlines())
(work / "normals.obj").write_text(
    CUBE + "".join(f"vn {.5 - x} {.5 - y} {.5 - z}\n" for z in (0, 1) for y in (0, 1) for x in (0, 1)) +
    "".join("f " + " ".join(f"{i}//{i}" for i in face.split()[1:]) + "\n" for face in right.splitlines()))
edges = [(math.cos(a), math.sin(a), math.cos(a / 2), math.sin(a / 2)) for a in (i * math.pi / 6 for i in range(12))]
(work / "moebius.obj").write_text(
    "".join(f"v {c * (1 + s * t)} {d * (1 + s * t)} {s * u}\n" for c, d, t, u in edges for s in (-.3, .3)) +
    "".join(f"f {2 * i + 1} {2 * i + 3} {2 * i + 4} {2 * i + 2}\n" for i in range(11)) + "f 23 2 1 24\n")
(work / "colours.obj").write_text(SQUARE.replace(" 0\n", " 0 1 0 0\n") + "f 1 2 3\nf 1 3 4\n")
(work / "parts.obj").write_text(SQUARE + "v 5 0 0\nv 5.01 0 0\nv 5 0.01 0\nf 1 2 3\nf 1 3 4\nf 5 6 7\n")
(work / "open.xyz").write_text("\n".join(points))
(work / "cloud.xyz").write_text("\n".join(points) + "\n")
(work / "stray.xyz").write_text("\n".join(points + ["1e6 0 0"]) + "\n")
(work / "far.xyz").write_text("8500000 8500000 0\n8500000.001 8500000 0\n8500000 8500000.001 0\n")
(work / "twice.xyz").write_text("\n".join(points * 2) + "\n")
(work / "unnamed.xyz").write_text("\n".join(f"{point} {i % 200} 80 90" for i, point in enumerate(points)) + "\n")
ply = ("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
       "element face 1\nproperty list uchar int vertex_indices\nend_header\n")
(work / "behind.ply").write_text(ply + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n9 9 9\n")
(work / "steps.ply").write_text(ply + "1e6 0 0\n1000001 0 0\n1e6 1 0\n3 0 1 2\n")
subprocess.run([programs / "pbm-sample", "-q", "--vertices", "10000", "-o", work / "sample.ply"], check=True)
CASES = [
    (["line.obj"], "dropped-attribute"),
    (["plain.obj", "--upsample", "3"], "idle-option"),
    (["loose.obj"], "loose-vertices"),
    (["image.obj"], "missing-image"),
    (["colours.obj", "--ignore-point-colours"], "replaced-attribute"),
    (["parts.obj", "--drop-parts", "1%"], "small-parts"),
    (["stray.xyz"], "stray-points"),
    (["behind.ply"], "trailing-bytes"),
    (["flat.obj"], "unusable-geometry"),
    (["steps.ply"], "coordinate-steps"),
    (["plain.obj"], "default-up-axis"),
    (["inwards.obj", "--no-orient-faces"], "inward-faces"),
    (["moebius.obj"], "one-sided-sheets"),
    (["stray.xyz", "--keep-outliers"], "kept-outliers"),
    (["open.xyz"], "open-end"),
    (["far.xyz"], "far-coordinates"),
    (["unnamed.xyz"], "guessed-columns"),
    (["twice.xyz"], "repeated-points"),
    (["inwards.obj"], "turned-faces"),
    (["normals.obj"], "turned-normals"),
    (["plain.obj", "--shadows"], "default-lights"),
    (["cloud.xyz"], "estimated-normals"),
    (["sample.ply"], "estimated-up-axis"),
    (["detailed.obj"], "finer-grid"),
    (["box.obj", "--fill-holes", "4"], "filled-holes"),
    (["cloud.xyz", "--upsample", "3"], "made-points"),
]
# A grid that needs too much memory: tests/unit/build/pipeline_test.cpp. The cache and batches: below.
WITHOUT_CASE = {"coarser-grid", "cache-not-filled", "left-out", "stale-model"}
expect({name for _, name in CASES} | WITHOUT_CASE == set(listed), "a name has no case")

for words, name in CASES:
    if name != "finer-grid":
        words = [*words, "--depth", "6"]
    words = [*words, "-o", "out.pbvg"]
    (work / "out.pbvg").write_text("old")
    denied = build(*words, "--deny", name, exit_code=3)
    expect(f"--deny {name}: " in denied.stderr and denied.stderr.count("\n") == 1, f"{name}: {denied.stderr}")
    expect((work / "out.pbvg").read_bytes() == b"old", f"{name}: the old output is lost")
    text = build(*words, "--json=report.json").stdout
    lines = [line for line in text.splitlines() if line.endswith(f"[{name}]")]
    expect(lines and all(f": {listed[name]}" in line for line in lines), f"{name}: not in the report:\n{text}")
    report = json.loads((work / "report.json").read_text())
    expect(name in [line.get("warning") for line in report["attributes"]], f"{name}: not in the JSON")
    expect(all((line["fate"] == listed[line["warning"]]) if "warning" in line else line["fate"] != "dropped"
               for line in report["attributes"]), f"{name}: a line has another fate than its name")
    log = work / "log"
    log.unlink(missing_ok=True)
    warned = build(*words, "--warnings", "--log", "log").stderr
    is_dropped = listed[name] == "dropped"
    expect((f"[{name}]" in warned) == is_dropped and (f"[{name}]" in log.read_text()) == is_dropped, f"{name}: {warned}")
    log.unlink()
    hidden = build(*words, "--allow", f"{name},open-end", "--log", "log")
    expect(f"[{name}]" not in hidden.stdout + log.read_text(), f"{name}: --allow does not hide it")

# Words.
for option in ("--deny", "--allow"):
    said = build("plain.obj", option, "stray-pionts", exit_code=1).stderr
    expect("did you mean stray-points?" in said, said)
    build("plain.obj", option, "", exit_code=1)
build("plain.obj", "--deny", "cache-not-filled", exit_code=1)
build("plain.obj", "--deny", "open-end", "--allow", "open-end", exit_code=1)
(work / "recipe.toml").write_text('input = "line.obj"\noutput = "recipe.pbvg"\ndeny = ["open-end", "dropped-attribute"]\n')
build("--recipe", "recipe.toml", exit_code=3)
expect(not (work / "recipe.pbvg").exists(), "the recipe's deny is not heard")

# A cache, and an output that is up to date, do not hide what is denied.
build("line.obj", "--depth", "6", "--cache", "cache", "--if-changed", "-o", "cached.pbvg")
build("line.obj", "--depth", "6", "--cache", "cache", "--if-changed", "-o", "cached.pbvg", "--deny", "dropped-attribute",
      exit_code=3)
expect((work / "cached.pbvg").exists(), "the old output is lost")
shutil.rmtree(work / "cache")
(work / "cache").write_text("")
for allow in ([], ["--allow", "cache-not-filled"]):
    said = build("plain.obj", "--cache", "cache", "-q", "-o", "out.pbvg", *allow).stderr  # a file, no folder
    expect(said.count("[cache-not-filled]") == said.count("\n") == (not allow), f"{allow}: {said}")
cache = work / "folder"
build("line.obj", "--depth", "6", "--cache", "folder", "-o", "out.pbvg")
model, = cache.glob("*.pbvg")
model.unlink()
model.mkdir()
for allow, count in (([], 1), (["--allow", "cache-not-filled"], 0)):
    said = build("line.obj", "--depth", "6", "--cache", "folder", "-q", "-o", "out.pbvg", *allow).stderr
    expect(said.count("[cache-not-filled]") == said.count("\n") == count, f"{allow}: {said}")

# Parts and batches.
parts = ["line.obj", "--depth", "6", "-o", "parts.pbvg"]
build(*parts, "--shard", "0/2", "--deny", "dropped-attribute", exit_code=3)
for i in range(2):
    hidden = build(*parts, "--shard", f"{i}/2", "--warnings", "--allow", "dropped-attribute").stderr
    expect(not hidden, hidden)
merged = build(*parts, "--merge", "2").stdout
expect("[dropped-attribute]" in merged, f"a part forgets the name: {merged}")
build(*parts, "--merge", "2", "--deny", "dropped-attribute", exit_code=3)  # these are parts of another build
for words, exit_code, count in (([], 0, 1), (["--allow", "dropped-attribute"], 0, 0),
                                (["--deny", "dropped-attribute"], 3, 0)):
    (work / "list").write_text("line.obj\n")
    done = build("--batch", "list", "--output-dir", "models", "--depth", "6", "--warnings", *words, exit_code=exit_code)
    expect(done.stderr.count("[dropped-attribute]") == count, f"batch {words}: {done.stderr}")
(work / "folder of scans").mkdir()
shutil.copy(work / "plain.obj", work / "folder of scans")
(work / "folder of scans/scene.fbx").write_text("")
(work / "models/other.pbvg").write_text("")
for name in ("left-out", "stale-model"):
    batch = ["--batch", "folder of scans", "--output-dir", "models", "--depth", "6"]
    expect(build(*batch, "--warnings").stderr.count(f"[{name}]") == 1, f"{name} is not said")
    expect(f"[{name}]" not in build(*batch, "--allow", name, "--warnings").stderr, f"--allow does not hide {name}")
    build(*batch, "--deny", name, exit_code=1)
for plan in ("plan.ninja", "plan.slurm"):
    build(*parts, "--shards", "2", "--plan", plan, "--deny", "open-end", "--allow", "dropped-attribute")
    text = (work / plan).read_text()
    expect("--deny=open-end" in text and "--allow=dropped-attribute" in text, f"{plan} forgets --deny or --allow")

print("\n".join(faults + [f"{len(listed)} warnings, {len(faults)} faults"]))
sys.exit(1 if faults else 0)
