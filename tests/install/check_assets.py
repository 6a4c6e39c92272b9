#!/usr/bin/env python3
"""Builds assets in a project that uses an installed PBM, then changes one thing at a time: exactly the assets that
depend on it must be rebuilt, with Ninja, Ninja Multi-Config and Make."""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import time

parser = argparse.ArgumentParser(description=__doc__)
for option in ("cmake", "build", "project", "compiler"):
    parser.add_argument("--" + option, required=True)
arguments = parser.parse_args()

TRIANGLE = """ply
format ascii 1.0
comment {comment}
element vertex 3
property float x
property float y
property float z
property float quality
element face 1
property list uchar int vertex_indices
end_header
0 0 0 1
{size} 0 0 1
0 1 0 1
3 0 1 2
"""
OBJECT = "mtllib material.mtl\nv 0 0 0\nv {size} 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"


def run(*command, **options):
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True, **options)
    if result.returncode != 0:
        sys.exit(f"FAILED with {result.returncode}: {' '.join(map(str, command))}\n{result.stdout}{result.stderr}")
    return result.stdout + result.stderr


class Project:
    """The project in a folder whose name has spaces, built with one generator."""

    MODELS = {"by_recipe": "models/by recipe.pbvg", "plain": "plain.pbvg", "with_material": "with_material.pbvg",
              "merged": "merged.pbvg"}

    def __init__(self, work, prefix, generator):
        self.generator = generator
        self.source, self.build = work / f"source of {generator}", work / f"build of {generator}"
        shutil.copytree(arguments.project, self.source)
        for folder in ("scans", "recipes"):
            (self.source / folder).mkdir()
        self.write("scans/plain scan.ply", TRIANGLE.format(comment="first", size=1))
        self.write("scans/recipe $ #1.ply", TRIANGLE.format(comment="first", size=2))
        self.write("scans/left scan.ply", TRIANGLE.format(comment="left", size=1))
        self.write("scans/right.ply", TRIANGLE.format(comment="right", size=4))
        self.write("scans/material.obj", OBJECT.format(size=1))
        self.write("scans/material.mtl", "newmtl red\nKd 1 0 0\n")
        self.write("recipes/by recipe.toml", 'input = "../scans/recipe $ #1.ply"\ndepth = 6\n')
        self.prefix = prefix
        self.configure()
        self.before = self.stamps()

    def configure(self, *options):
        run(arguments.cmake, "-S", self.source, "-B", self.build, "-G", self.generator,
            f"-DCMAKE_PREFIX_PATH={self.prefix}", f"-DCMAKE_CXX_COMPILER={arguments.compiler}", *options)

    def write(self, name, text):
        time.sleep(0.02)  # longer than the resolution of file times
        (self.source / name).write_text(text)

    def touch(self, name):
        time.sleep(0.02)
        os.utime(self.source / name)

    def model(self, asset):
        return self.build / self.MODELS[asset]

    def stamps(self):
        files = {asset: self.model(asset) for asset in self.MODELS}
        return {a: (f.stat().st_ino, f.stat().st_mtime_ns, f.read_bytes()) for a, f in files.items() if f.exists()}

    def expect(self, what, built, used=None, looked_at=None):
        """Builds; returns what that printed. Expects new files of `built`, an output made of each of `used`, and calls of
        pbm-build for `looked_at`."""
        log = self.build / "used.log"
        log.unlink(missing_ok=True)
        output = run(arguments.cmake, "--build", self.build)
        after = self.stamps()
        found = {
            "built": {asset for asset in self.MODELS if after.get(asset) != self.before.get(asset)},
            "used": set(log.read_text().split()) if log.exists() else set(),
            "looked at": {asset for asset, name in self.MODELS.items() if f"Building {name}" in output},
        }
        expected = {
            "built": set(built),
            "used": set(built if used is None else used),
            "looked at": set(built if looked_at is None else looked_at),
        }
        for kind, assets in expected.items():
            if found[kind] != assets:
                sys.exit(f"FAILED: {self.generator}: {what}: {kind} is {found[kind]}, expected {assets}\n{output}")
        self.before = after
        return output


def walk(project):
    every = set(Project.MODELS)
    # Make compares times only and calls pbm-build while the output is older. pbm-build then only reads and hashes.
    again = lambda assets: set() if project.generator.startswith("Ninja") else set(assets)
    output = project.expect("first build", every)
    dropped = "pbm-build: warning: vertex.quality dropped"
    logs = [pathlib.Path(f"{project.model(asset)}.log") for asset in ("plain", "by_recipe")]
    if dropped not in output or not all("warning: vertex.quality dropped" in log.read_text() for log in logs):
        sys.exit(f"FAILED: {project.generator}: what is dropped is no warning of the build\n{output}")
    project.expect("nothing changed", set())

    for scan in ("plain scan.ply", "recipe $ #1.ply", "material.obj", "material.mtl", "right.ply"):
        project.touch(f"scans/{scan}")
    project.expect("inputs touched", set(), looked_at=every)
    project.expect("nothing changed after touching", set(), looked_at=again(every))

    project.write("scans/plain scan.ply", TRIANGLE.format(comment="second", size=1))
    project.expect("a comment of an input changed", set(), looked_at={"plain"} | again(every))
    project.write("scans/plain scan.ply", TRIANGLE.format(comment="second", size=3))
    project.expect("an input changed", {"plain"}, looked_at={"plain"} | again(every))
    project.write("scans/recipe $ #1.ply", TRIANGLE.format(comment="first", size=3))
    project.expect("an input that the recipe names changed", {"by_recipe"},
                   looked_at={"by_recipe"} | again({"with_material", "merged"}))
    project.write("scans/left scan.ply", TRIANGLE.format(comment="left", size=8))
    project.expect("one of two merged inputs changed", {"merged"}, looked_at={"merged"} | again({"with_material"}))
    project.write("scans/material.mtl", "newmtl red\nKd 0 1 0\n")
    project.expect("a material file changed", {"with_material"})
    project.write("scans/material.obj", OBJECT.format(size=2))
    project.expect("an object changed", {"with_material"})
    project.expect("nothing changed after changes", set())

    project.write("recipes/by recipe.toml", 'input = "../scans/recipe $ #1.ply"\ndepth = 7\n')
    project.expect("the recipe changed", {"by_recipe"})
    project.model("plain").unlink()
    project.expect("an output was deleted", {"plain"})
    project.configure("-DGIVEN_OPTIONS=--up;z")
    project.expect("an option was added", {"plain"})
    project.configure()
    project.expect("configured again", set())

    damaged = project.model("with_material")
    data = bytearray(damaged.read_bytes())
    data[-20] ^= 1
    damaged.write_bytes(data)
    project.touch("scans/material.obj")
    project.expect("an output was damaged", {"with_material"})
    run(project.prefix / "bin" / "pbm-validate", "-q", *(project.model(a) for a in every))


work = pathlib.Path(arguments.build).resolve() / "tests" / "install" / "assets"
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
prefix = work / "prefix of pbm"
run(arguments.cmake, "--install", arguments.build, "--prefix", prefix)
for generator in ("Ninja", "Ninja Multi-Config", "Unix Makefiles"):
    walk(Project(work, prefix, generator))
    print(f"{generator}: good")
