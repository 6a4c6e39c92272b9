#!/usr/bin/env python3
"""--action-key is the key under which --cache keeps the output: it depends on all that decides the bytes, and on nothing
else. The recipe of docs/how-to/build-system.md shares models by it: check_action_key.py ROOT PROGRAMS WORK"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

root, programs, work = (pathlib.Path(word).resolve() for word in sys.argv[1:])
work = work / "action_key"
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
faults = []
OBJECT = "mtllib scan.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"


def expect(condition, what):
    if not condition:
        faults.append(what)


def run(*words, exit_code=0, folder=work, **environment):
    done = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True,
                          env={**os.environ, **environment})
    expect(done.returncode == exit_code, f"{words}: exit code {done.returncode}: {done.stderr}")
    return done


def key(*words):
    done = run(programs / "pbm-build", "--action-key", *words)
    expect(re.fullmatch(r"[0-9a-f]{32}\n", done.stdout) and not done.stderr, f"{words}: {done.stdout}{done.stderr}")
    return done.stdout.strip()


(work / "scan.obj").write_text(OBJECT)
(work / "scan.mtl").write_text("newmtl red\nKd 1 0 0\n")
(work / "recipe.toml").write_text('input = "scan.obj"\ndepth = 6\n')
plain = key("scan.obj", "--depth", "6")
expect(sorted(p.name for p in work.iterdir()) == ["recipe.toml", "scan.mtl", "scan.obj"], "--action-key writes a file")

same = [["scan.obj", "--depth=6", "-o", "missing/other.pbvg", "-j1", "-q"], ["--recipe", "recipe.toml"],
        ["scan.obj", "--depth", "6", "--allow", "stray-points", "--max-memory", "1G", "-MF", "x.d"]]
for words in same:
    expect(key(*words) == plain, f"{words} have another key")
others = [["scan.obj", "--depth", "7"], ["scan.obj", "--depth", "6", "--if-changed"], ["scan.obj"],
          ["scan.obj", "--depth", "6", "--deny", "stray-points"], ["scan.obj", "--depth", "6", "-z", "3"]]
keys = {plain} | {key(*words) for words in others}
(work / "scan.mtl").write_text("newmtl red\nKd 0 1 0\n")
keys.add(key("scan.obj", "--depth", "6"))
(work / "scan.mtl").unlink()
keys.add(key("scan.obj", "--depth", "6"))
expect(len(keys) == len(others) + 3, f"{len(others) + 3} different builds have {len(keys)} keys")

for words in (["-"], ["scan.obj", "--shard", "0/2"], ["scan.obj", "--merge", "2"], ["--batch", ".", "--output-dir", "x"]):
    run(programs / "pbm-build", "--action-key", *words, "-o" if "--batch" not in words else "-q",
        *([] if "--batch" in words else ["x.pbvg"]), exit_code=1)
run(programs / "pbm-build", "--action-key", "no.obj", exit_code=2)

# The recipe of the page, with a folder as the remote store. The program writes a line for each call.
page = (root / "docs/how-to/build-system.md").read_text()
recipe = re.search(r"```sh\n(remote=.*?)```", page, re.DOTALL)[1]
counting = work / "counting"
counting.mkdir()
(counting / "pbm-build").write_text(f'#!/bin/sh\necho "$*" >>{work}/calls\nexec {programs}/pbm-build "$@"\n')
(counting / "pbm-build").chmod(0o755)
remote = work / "remote"
remote.mkdir()


def fetch_or_build(machine):
    """Runs the recipe in a folder. Returns whether it built."""
    folder = work / machine
    folder.mkdir(exist_ok=True)
    (folder / "scan.ply").write_bytes(scan)
    (work / "calls").write_text("")
    run("sh", "-c", recipe, folder=folder, PBM_REMOTE=str(remote), PATH=f"{counting}:{programs}:{os.environ['PATH']}")
    expect(sorted(p.name for p in folder.iterdir()) == ["scan.ply", "scan.pbvg"][::-1], f"{machine} keeps other files")
    return len((work / "calls").read_text().splitlines()) == 3, (folder / "scan.pbvg").read_bytes()


def ply(size):
    return (b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n%d 0 0\n0 1 0\n3 0 1 2\n" % size)


scan = ply(1)
built, first = fetch_or_build("first")
expect(built, "the first machine does not build")
built, second = fetch_or_build("second")
expect(not built and second == first, "the second machine does not take the model of the first")
stored, = remote.iterdir()
run(programs / "pbm-build", "scan.ply", "--depth", "8", "--cache", "cache", folder=work / "first")
kept, = (work / "first/cache").glob("*.pbvg")
expect(stored.stem in kept.name and kept.read_bytes() == first, f"--cache keeps {kept.name}, the store {stored.name}")
shutil.rmtree(work / "first/cache")
stored.write_bytes(first[:-1])
built, third = fetch_or_build("third")
expect(built and third == first and stored.read_bytes() == first, "a damaged model is taken from the store")
scan = ply(2)
built, other = fetch_or_build("first")
expect(built and other != first and len(list(remote.iterdir())) == 2, "another scan has the model of the first")

print("\n".join(faults + [f"{len(keys)} keys, {len(faults)} faults"]))
sys.exit(1 if faults else 0)
