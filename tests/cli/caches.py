#!/usr/bin/env python3
"""Caches of models never show another scan, and never cost a picture or a model:
caches.py PROGRAMS WORK_FOLDER [COARSE_TIMES_LIBRARY]"""

import os
import pathlib
import pwd
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from commands import check, must  # noqa: E402

programs, work = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
coarse = sys.argv[3] if len(sys.argv) > 3 else None
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
EPOCH = 1_700_000_000
RESOLUTION = "--resolution=64,48"


def scan(colour):
    """A triangle; each has as many bytes as the others."""
    points = ((0, 0, 0), (1, 0, 0), (0, 1, 0))
    return "\n".join(["ply", "format ascii 1.0", "element vertex 3", *(f"property float {axis}" for axis in "xyz"),
                      *(f"property uchar {name}" for name in ("red", "green", "blue")), "element face 1",
                      "property list uchar int vertex_indices", "end_header",
                      *(" ".join(map(str, point + colour)) for point in points), "3 0 1 2", ""]).encode()


SCANS = {"red": scan((200, 10, 10)), "blue": scan((10, 10, 200)), "grey": scan((90, 90, 90))}
check(len({len(content) for content in SCANS.values()}) <= 2, "the scans have other sizes")
SCANS = {name: content.ljust(max(map(len, SCANS.values())), b"\n") for name, content in SCANS.items()}


def run(*command, **options):
    command = [str(programs / command[0]), *map(str, command[1:])]
    return subprocess.run(command, cwd=work, capture_output=True, text=True, timeout=300, **options)


def good(*command, **options):
    result = run(*command, **options)
    check(result.returncode == 0, f"{command}: exit code {result.returncode}: {result.stderr}")
    return result.stderr


# What is right: each scan built anew.
PICTURES, MODELS = {}, {}
for name, content in SCANS.items():
    (work / f"{name}.ply").write_bytes(content)
    good("pbm-render", f"{name}.ply", "--cache", "none", "-q", RESOLUTION, "-o", f"{name}.png")
    good("pbm-build", f"{name}.ply", "--depth", "6", "-q", "-o", f"{name}.pbvg")
    PICTURES[name], MODELS[name] = (work / f"{name}.png").read_bytes(), (work / f"{name}.pbvg").read_bytes()
check(len(set(PICTURES.values())) == len(SCANS), "the scans look alike")
target = work / "scan.ply"


def in_place(content, time):
    """As `cp -p` onto a file that is there, `rsync --inplace -t`."""
    target.write_bytes(content)
    os.utime(target, ns=(time, time))


def renamed(content, time):
    """As `rsync -t`: another file of the name."""
    other = target.with_name(".scan.ply.x")
    other.write_bytes(content)
    os.utime(other, ns=(time, time))
    other.replace(target)


def unpacked(content, time):
    folder = work / "packed"
    folder.mkdir(exist_ok=True)
    (folder / target.name).write_bytes(content)
    os.utime(folder / target.name, ns=(time, time))
    must("tar", "-C", folder, "-cf", work / "scan.tar", target.name)
    must("tar", "-C", work, "-xf", work / "scan.tar")


def synchronized(content, time):
    folder = work / "packed"
    folder.mkdir(exist_ok=True)
    (folder / target.name).write_bytes(content)
    os.utime(folder / target.name, ns=(time, time))
    must("rsync", "-t", "--ignore-times", folder / target.name, target)


def draw(what, wanted, environment=None):
    said = good("pbm-render", target.name, "--cache", "cache", "-q", RESOLUTION, "-o", "drawn.png", env=environment)
    check(not said, f"{what}: {said}")
    found = [name for name, picture in PICTURES.items() if picture == (work / "drawn.png").read_bytes()]
    check(found == [wanted], f"{what}: {found} is drawn, and not {wanted}")


def build(what, wanted):
    for words in (("--cache", "models"), ("--if-changed", "--cache", "models")):
        good("pbm-build", target.name, "--depth", "6", "-q", *words, "-o", "built.pbvg")
    good("pbm-build", target.name, "--depth", "6", "-q", "--cache", "models", "-o", "built.pbvg")
    check((work / "built.pbvg").read_bytes() == MODELS[wanted], f"{what}: another model than {wanted} is built")


def exchange(way, time):
    for wanted in ("red", "blue", "grey", "red"):
        way(SCANS[wanted], time)
        draw(f"{way.__name__}, time {time}", wanted)
        build(f"{way.__name__}, time {time}", wanted)


now = int(target.parent.stat().st_mtime)
ways = [in_place, renamed, unpacked] + ([synchronized] if shutil.which("rsync") else [])
for way in ways:
    # Times of SOURCE_DATE_EPOCH, of a clock that went back, of one that is ahead.
    for time in (EPOCH, now - 86_400, now + 86_400):
        exchange(way, time * 10**9)

# A recipe, and the program itself, of the same size and time.
recipe, program = work / "all.toml", work / "bin/pbm-build"
program.parent.mkdir()
in_place(SCANS["red"], EPOCH * 10**9)
for depth in (5, 6):
    recipe.write_text(f"depth = {depth}\n")
    os.utime(recipe, (EPOCH, EPOCH))
    program.write_text(f'#!/bin/sh\nexec {programs}/pbm-build --name "version {depth}" "$@"\n')
    program.chmod(0o755)
    os.utime(program, (EPOCH, EPOCH))
    for words, kept in ((("--recipe", "all.toml"), "recipes"), ((), "versions")):
        renderer = programs / "pbm-render" if words else shutil.copy(programs / "pbm-render", program.parent)
        must(renderer, target.name, "--cache", kept, "-q", RESOLUTION, *words, "-o", "drawn.png", cwd=work)
for folder, member, values in (("recipes", "depth", [5, 6]), ("versions", "metadata", ["version 5", "version 6"])):
    info = [must(programs / "pbm-info", "--json", path) for path in (work / folder).glob("*.pbvg")]
    check(all(any(f'"{value}"' in text or f'"{member}": {value}' in text for text in info) for value in values),
          f"{folder}: a model of another one is shown")

# Times of whole seconds, as on NFS. Within one of them a scan changes without a trace in its times.
if coarse:
    environment = {**os.environ, "LD_PRELOAD": coarse}
    for turn in range(8):
        for wanted in ("red", "blue"):
            in_place(SCANS[wanted], EPOCH * 10**9)
            draw("times of whole seconds", wanted, environment)

# Folders that cannot be used. Each costs a warning alone.
in_place(SCANS["red"], EPOCH * 10**9)
must("chmod", "-R", "a+rX", work)


def with_bad_cache(what, folder, before=(), **options):
    """`before`: a command in front of the program."""
    for program, words, output in (
            ("pbm-render", [RESOLUTION, "--cache", folder], "drawn.png"),
            ("pbm-build", ["--depth", "6", "--cache", folder], "built.pbvg"),
            ("pbm-build", ["--depth", "6", "--cache", folder], "out/scan.pbvg")):
        is_batch = output.startswith("out/")
        path = outputs / output
        path.unlink(missing_ok=True)
        command = [programs / program, *(["--batch", "list", "--output-dir", path.parent] if is_batch else [target.name, "-o", path]),
                   *words]
        result = subprocess.run([*before, *map(str, command)], cwd=work, capture_output=True, text=True, timeout=300, **options)
        check(result.returncode == 0, f"{what}, {program}: exit code {result.returncode}: {result.stderr}")
        wanted = PICTURES["red"] if program == "pbm-render" else MODELS["red"]
        check(path.read_bytes() == wanted, f"{what}, {program}: not what is built without a cache")
        lines = result.stderr.splitlines()
        check(len(lines) == 1 and "the cache is not" in lines[0] and ": warning: " in lines[0] and str(folder) in lines[0],
              f"{what}, {program}: {lines}")


outputs = work / "outputs"
(outputs / "out").mkdir(parents=True)
(work / "list").write_text("scan.ply\n")
(work / "file").write_text("")
with_bad_cache("a file in place of the folder", work / "file")
with_bad_cache("a folder in a file", work / "file/cache")

closed = work / "closed"
closed.mkdir()
closed.chmod(0o555)
must("chmod", "-R", "a+rwX", outputs)
as_root = os.geteuid() == 0
nobody = {"user": "nobody", "group": pwd.getpwnam("nobody").pw_gid, "extra_groups": []} if as_root else {}
reachable = run("pbm-info", "red.pbvg", **nobody).returncode == 0 if as_root else True
skipped = []
if reachable:
    with_bad_cache("a folder of another owner", closed, **nobody)
    with_bad_cache("a folder that cannot be made", closed / "cache", **nobody)
    hidden = work / "hidden"
    hidden.mkdir()
    shutil.copy(work / "red.pbvg", hidden / "scan-0123456789abcdef.pbvg")
    hidden.chmod(0 if not as_root else 0o700)
    with_bad_cache("a folder that cannot be read", hidden, **nobody)
    hidden.chmod(0o700)
else:
    skipped.append("the programs lie where another user cannot run them")


def mounted(options):
    """A command in front of a program, for which the folder `mount` is another file system; None if that is not to be."""
    (work / "mount").mkdir(exist_ok=True)
    script = f'mount -t tmpfs -o {options} tmpfs "{work}/mount" && exec "$@"'
    before = ["unshare", "-m", "sh", "-c", script, "sh"]
    return before if as_root and subprocess.run([*before, "true"], capture_output=True).returncode == 0 else None


if mounted("size=64k"):
    full = mounted("size=64k")
    full[4] = full[4].replace(" && exec", f' && ! head -c 1M /dev/zero 2>/dev/null >"{work}/mount/zeros" && exec')
    with_bad_cache("a full disk", work / "mount", full)
    with_bad_cache("a disk that is read only", work / "mount", mounted("size=64k,ro"))
    with_bad_cache("a folder on a disk that is read only", work / "mount/cache", mounted("size=64k,ro"))
else:
    skipped.append("no disk can be mounted here")

# A cache of someone else that holds the model is used.
if reachable:
    shared = work / "shared"
    good("pbm-build", target.name, "--depth", "6", "-q", "--cache", "shared", "-o", "built.pbvg")
    shared.chmod(0o555)
    for path in shared.iterdir():
        path.chmod(0o444)
    (outputs / "built.pbvg").unlink()
    result = run("pbm-build", target.name, "--depth", "6", "--cache", shared, "-o", outputs / "built.pbvg", **nobody)
    check("from the cache" in result.stdout and not result.stderr, f"a cache to read: {result}")
print("passed" + "".join(f"; skipped: {why}" for why in skipped))
