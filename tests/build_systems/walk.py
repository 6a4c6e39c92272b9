#!/usr/bin/env python3
"""A seeded random walk through a folder of scans, with material files, images, buffers and a recipe: a step changes,
exchanges, removes, adds, renames or touches files, restores old times, kills a build, or installs another version of
pbm-build. After every step each way of building has the models of a fresh build, or fails as the fresh build does:

    walk.py ROOT PROGRAMS WORK [--steps N] [--seed N] [--tools NAME,..]"""

import argparse
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import time

import scans

parser = argparse.ArgumentParser()
for name in ("root", "programs", "work"):
    parser.add_argument(name, type=pathlib.Path)
parser.add_argument("--steps", type=int, default=60)
parser.add_argument("--seed", type=int, default=1)
parser.add_argument("--tools", default="batch,cache,parts,ninja,make,plan,cmake")
arguments = parser.parse_args()
root, programs = arguments.root.resolve(), arguments.programs.resolve()
work = arguments.work.resolve() / f"walk_{arguments.steps}"
chance = random.Random(arguments.seed)
GREEN = scans.png((20, 200, 20))
PROGRAM = "./pbm-build"
SCANS = (".obj", ".gltf", ".ply", ".conf")
TICK = 0.02  # longer than the resolution of file times


def run(words, kill_after=None):
    """The exit code; what was said is kept for a fault."""
    process = subprocess.Popen([str(word) for word in words], cwd=work, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                               text=True, start_new_session=True)
    try:
        run.said, _ = process.communicate(timeout=kill_after)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        run.said, _ = process.communicate()
    return process.returncode


def description(model):
    """Of all that a model holds but its record of sources: --if-changed leaves a model as it is, with its older record,
    if another build makes the same (docs/explanation/programs.md)."""
    text = subprocess.run([programs / "pbm-info", "--json", model], capture_output=True, text=True, check=True).stdout
    document = json.loads(text)
    for word in ("source_hash", "source_files", "request_hash"):
        document["metadata"].pop(word, None)
    return {word: value for word, value in document.items() if word not in ("file", "file_bytes")}


def is_model(path, wanted):
    """Whether the file `path` is the model of these bytes."""
    if not path.exists():
        return False
    if path.read_bytes() == wanted:
        return True
    other = work / "fresh/wanted.pbvg"
    other.write_bytes(wanted)
    return description(path) == description(other)


class World:
    """The files, and what fresh builds make of them."""

    def __init__(self):
        shutil.rmtree(work, ignore_errors=True)
        self.fresh_models = {}
        self.away = []  # (folder, name, content) of files that were removed
        self.version = 0
        for name, write in (("mesh", scans.write_obj), ("scene", scans.write_gltf), ("skin", scans.write_ply)):
            folder = work / "scans" / name
            folder.mkdir(parents=True)
            write(folder)
        (work / "scans/plain").mkdir()
        (work / "scans/plain/plain.ply").write_bytes(scans.ply(1))
        (work / "fresh").mkdir()
        self.install()
        self.set_recipe(5)

    def install(self):
        """Another version, which makes other models, with an old time."""
        self.version += 1
        program = work / "pbm-build"
        program.write_text(f"""#!/bin/sh
[ "$1" = --version ] && echo "pbm-build {self.version}" && exit
exec {programs}/pbm-build --name "version {self.version}" "$@"
""")
        program.chmod(0o755)
        os.utime(program, (0, 0))

    def set_recipe(self, depth):
        (work / "all.toml").write_text(f"depth = {depth}\n")

    def scans(self):
        return sorted(path for path in (work / "scans").rglob("*") if path.suffix in SCANS and path.is_file())

    def files(self):
        return sorted(path for path in (work / "scans").rglob("*") if path.is_file())

    def fresh(self, scan, *options):
        """The bytes of a fresh build; None if it fails."""
        state = (self.version, (work / "all.toml").read_text(), scan.name, options,
                 tuple((path.name, path.read_bytes()) for path in sorted(scan.parent.iterdir())))
        if state not in self.fresh_models:
            out = work / "fresh/model.pbvg"
            out.unlink(missing_ok=True)
            code = run([PROGRAM, scan, "--recipe", "all.toml", *options, "-o", out])
            self.fresh_models[state] = out.read_bytes() if code == 0 else None
        return self.fresh_models[state]

    # Steps. Each returns what it did; `times` says whether tools that compare times can see it.

    def content_for(self, path):
        """Another content of the kind of this file."""
        if path.suffix.lower() == ".png":
            return chance.choice([scans.RED, scans.BLUE, GREEN])
        if path.suffix == ".ply" and b"TextureFile" not in path.read_bytes():
            return scans.ply(chance.randint(1, 4))
        if path.suffix == ".mtl":
            a, b = chance.choice([("a", "b"), ("b", "a"), ("a", "a"), ("c", "b")])
            return f"newmtl a\nmap_Kd {a}.png\nnewmtl b\nmap_Kd {b}.png\n".encode()
        if path.suffix == ".obj":
            return path.read_bytes().replace(b"v 3 1 0", b"v 3 %d 0" % chance.randint(1, 3))
        data = bytearray(path.read_bytes())
        if path.suffix == ".bin":
            data[8:12] = chance.choice([b"\0\0\0\0", b"\0\0\0?"])
        return bytes(data)

    def change(self):
        path = chance.choice(self.files())
        path.write_bytes(self.content_for(path))
        return f"change {path.name}"

    def exchange(self):
        folder = chance.choice(sorted({path.parent for path in self.files()}))
        images = [path for path in sorted(folder.iterdir()) if path.suffix.lower() == ".png"]
        if len(images) < 2:
            return self.change()
        a, b = chance.sample(images, 2)
        first, second = a.read_bytes(), b.read_bytes()
        a.write_bytes(second)
        b.write_bytes(first)
        return f"exchange {a.name} and {b.name} of {folder.name}"

    def remove(self):
        named = [path for path in self.files() if path.suffix not in SCANS]
        if not named:
            return self.add()
        path = chance.choice(named)
        self.away.append((path.parent, path.name, path.read_bytes()))
        path.unlink()
        return f"remove {path.name} of {path.parent.name}"

    def add(self):
        if not self.away:
            return self.remove()
        folder, name, content = self.away.pop(chance.randrange(len(self.away)))
        path = folder / name
        path.write_bytes(content)
        if chance.random() < 0.5:
            os.utime(path, (1, 1))
        return f"add {name} to {folder.name}"

    def add_scan(self):
        path = work / f"scans/more/scan {chance.randint(1, 3)}.ply"
        path.parent.mkdir(exist_ok=True)
        if path.exists():
            path.unlink()
            return f"remove {path.name}"
        path.write_bytes(scans.ply(chance.randint(1, 4)))
        return f"add {path.name}"

    def rename(self):
        path = chance.choice(self.files())
        if path.suffix in SCANS:
            other = path.with_name(("other " if not path.name.startswith("other ") else "") + path.name.split()[-1])
        else:
            other = path.with_name(path.name.swapcase())
        if other.exists() or other == path:
            return self.change()
        path.rename(other)
        os.utime(other)
        return f"rename {path.name} to {other.name}"

    def touch(self):
        path = chance.choice(self.files())
        os.utime(path)
        return f"touch {path.name}"

    def other_recipe(self):
        self.set_recipe(chance.choice([5, 6]))
        return "another recipe"

    def upgrade(self):
        self.install()
        return "another version"


class Tool:
    """A way of building all scans into a folder of its own."""

    record = ["--source-hash"]  # with which fresh builds are compared
    sees_old_times = False      # a content that comes with an old time

    def __init__(self, world):
        self.world, self.known = world, None
        self.folder = work / type(self).__name__.lower()
        self.folder.mkdir()

    def model_of(self, scan):
        return self.folder / scan.relative_to(work / "scans").with_suffix(".pbvg")

    def prepare(self):
        """Writes what names the scans anew where they are others, as a user does."""
        known = self.world.scans(), self.world.version
        if known != self.known:
            for scan in self.world.scans():
                self.model_of(scan).parent.mkdir(parents=True, exist_ok=True)
            if self.write() not in (None, 0):
                return False
            self.known = known
        return True

    def write(self):
        return 0

    def check(self, what):
        """The fault, or nothing."""
        fresh = {scan: self.world.fresh(scan, *self.record) for scan in self.world.scans()}
        is_good = None not in fresh.values()
        if not self.prepare() or run(self.command()) != 0:
            return f"{what}: fails, and a fresh build does not:\n{run.said}" if is_good else None
        if not is_good:
            return f"{what}: exit code 0, and a fresh build fails"
        wrong = [str(self.model_of(scan)) for scan, model in fresh.items() if not is_model(self.model_of(scan), model)]
        return f"{what}: not the models of a fresh build: {', '.join(wrong)}\n{run.said}" if wrong else None


class Batch(Tool):
    sees_old_times = True

    def command(self):
        return [PROGRAM, "--batch", "scans", "--output-dir", self.folder, "--recipe", "all.toml", "--if-changed",
                "--keep-going"]


class Cache(Tool):
    record = []
    sees_old_times = True

    def command(self):
        return [PROGRAM, "--batch", "scans", "--output-dir", self.folder, "--recipe", "all.toml", "--cache", "store",
                "--keep-going"]


class Parts(Tool):
    record = []
    sees_old_times = True

    def command(self):
        """Shards and merges, and forgets a shard now and then: its part may be of older files."""
        lines = ["set -e"]
        for scan in self.world.scans():
            one = f"{PROGRAM} '{scan}' --recipe all.toml -o '{self.model_of(scan)}'"
            shards = [f"{one} --shard {i}/2" for i in range(2)]
            if chance.random() < 0.2:
                forgotten = shards.pop(chance.randrange(2))
                lines += [*shards, f"{one} --merge 2 || {{ {forgotten}; {one} --merge 2; }}"]
            else:
                lines += [*shards, f"{one} --merge 2"]
        return ["sh", "-c", "\n".join(lines)]


class Ninja(Tool):
    def write(self):
        example = (root / "examples/assets/build.ninja").read_text().replace("pbm-build ", f"{PROGRAM} ")
        rules = example[:example.index("build cube.pbvg")].replace("--recipe $in", "--recipe all.toml").replace(
            "-o $out", "-o $out $in")
        paths = {scan: [str(path).replace(" ", "$ ") for path in (self.model_of(scan), scan)] for scan in self.world.scans()}
        (work / "build.ninja").write_text(rules + "".join(
            f"build {model}: pbm {scan} | pbm-build.version\n" for model, scan in paths.values()))

    def command(self):
        return ["ninja", "-k", "0"]


class Make(Tool):
    def write(self):
        example = (root / "examples/assets/Makefile").read_text()
        head = example[:example.index("cube.pbvg:")]
        models, rules = [], ""
        for scan in self.world.scans():
            model, source = (str(path).replace(" ", "\\ ") for path in (self.model_of(scan), scan))
            models.append(model)
            rules += (f"{model}: {source} pbm-build.version\n\t$(PBM_BUILD) --warnings '{scan}' --recipe all.toml "
                      f"--if-changed -MF '{self.model_of(scan)}.d' -o '{self.model_of(scan)}'\n-include {model}.d\n")
        (work / "Makefile").write_text(f"all: {' '.join(models)}\n{head}{rules}")

    def command(self):
        return ["make", "-k", f"PBM_BUILD={PROGRAM}"]


class Plan(Tool):
    def write(self):
        return run([PROGRAM, "--batch", "scans", "--output-dir", self.folder, "--recipe", "all.toml", "--plan",
                    "plan.ninja"])

    def command(self):
        return ["ninja", "-k", "0", "-f", "plan.ninja"]


class Cmake(Tool):
    def write(self):
        project = work / "project"
        project.mkdir(exist_ok=True)
        assets = "".join(f'pbm_add_asset(asset{i} SOURCES "{scan}" RECIPE "{work}/all.toml" OUTPUT "{self.model_of(scan)}")\n'
                         for i, scan in enumerate(self.world.scans()))
        (project / "CMakeLists.txt").write_text(f"""cmake_minimum_required(VERSION 3.21)
project(walk LANGUAGES NONE)
add_executable(pbm::pbm-build IMPORTED GLOBAL)
set_target_properties(pbm::pbm-build PROPERTIES IMPORTED_LOCATION "{work}/pbm-build")
include("{root}/cmake/PbmAddAsset.cmake")
{assets}""")
        return run(["cmake", "-S", project, "-B", work / "build", "-G", "Unix Makefiles"])

    def command(self):
        return ["cmake", "--build", work / "build", "--", "-k"]


TOOLS = {tool.__name__.lower(): tool for tool in (Batch, Cache, Parts, Ninja, Make, Plan, Cmake)}
world = World()
tools = [TOOLS[name](world) for name in arguments.tools.split(",")
         if shutil.which({"plan": "ninja"}.get(name, name)) or name in ("batch", "cache", "parts")]
steps = [world.change] * 4 + [world.exchange] * 4 + [world.remove] * 2 + [world.add] * 4 + [world.add_scan, world.rename,
         world.touch, world.other_recipe, world.upgrade]


def fail(number, what, tool, fault):
    sys.exit(f"step {number} of seed {arguments.seed}: {what}: {type(tool).__name__}: {fault}")


for number in range(arguments.steps):
    time.sleep(TICK)
    if number % 100 == 0:
        print(f"step {number}", flush=True)
    what = chance.choice(steps)() if number else "at first"
    if chance.random() < 0.1:  # the same content as before with the old times of others
        path = chance.choice(world.files())
        before = path.stat().st_mtime_ns
        path.write_bytes(world.content_for(path))
        os.utime(path, ns=(before, before))
        for tool in tools:
            if tool.sees_old_times and (fault := tool.check("an old time")):
                fail(number, what, tool, fault)
        time.sleep(TICK)
        os.utime(path)
    for tool in tools:
        if chance.random() < 0.15 and tool.prepare():
            run(tool.command(), kill_after=chance.uniform(0.005, 0.3))
        if fault := tool.check("a build"):
            fail(number, what, tool, fault)
print(f"{arguments.steps} steps, {len(world.fresh_models)} states of scans, {len(tools)} ways to build")
