#!/usr/bin/env python3
"""Every printable character in a name, alone and in pairs, at its beginning, in its middle and at its end: pbm-build
refuses the name for a dependency file, or Make, Ninja, CMake and Meson depend on that very file. The characters that are
refused are those of docs/reference/cmake.md: check_depfiles.py ROOT PROGRAMS WORK"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

import scans

root, programs, work = (pathlib.Path(word).resolve() for word in sys.argv[1:])
work = work / "depfiles"
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
PRINTABLE = [chr(code) for code in range(32, 127) if chr(code) != "/"]
SCAN = scans.ply(1)
faults = []


def expect(condition, what):
    if not condition:
        faults.append(what)


def run(*words, folder=work, fails=False):
    done = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True,
                          env={**os.environ, "LC_ALL": "C.UTF-8", "PATH": f"{programs}:{os.environ['PATH']}"})
    if (done.returncode != 0) != fails:
        sys.exit(f"{' '.join(map(str, words))[:300]}: exit code {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    return done


def write_depfile(names, folder, depfile, target="out", recipe="recipe"):
    """One model of all scans with these names, and its dependency file. Returns the exit code."""
    (folder / "recipe").write_text(f"input = {json.dumps(names)}\n")
    return subprocess.run([programs / "pbm-build", "--quiet", "--depth", "5", "--recipe", recipe, "-MF", depfile, "-MQ",
                           target, "-o", "out"], cwd=folder, capture_output=True).returncode


def takes(name):
    (work / "one").mkdir(exist_ok=True)
    path = work / "one" / name
    path.write_bytes(SCAN)
    code = write_depfile([name], work / "one", "d")
    path.unlink()
    expect(code in (0, 1), f"{name!r}: exit code {code}")
    return code == 0


# Which characters are refused where: a name with two of them is refused if one is.
refused = {place: {c for c in PRINTABLE if not takes(name.replace("?", c))}
           for place, name in {"first": "?b", "middle": "a?b", "last": "a?"}.items()}
anywhere = refused["first"] & refused["middle"] & refused["last"]
page = " ".join((root / "docs/reference/cmake.md").read_text().split())
listed = re.search(r"Names with `([^`]*)` or a backquote anywhere, with `([^`]*)` at their beginning, with `([^`]*)` or a "
                   r"blank at their end", page)
expect(listed is not None, "docs/reference/cmake.md names no characters")
if listed:
    expect(anywhere == set(listed[1].replace(" ", "")) | {"`"}, f"refused anywhere: {sorted(anywhere)}")
    expect(refused["first"] - anywhere == set(listed[2].replace(" ", "")), f"at the beginning: {sorted(refused['first'])}")
    expect(refused["last"] - anywhere == set(listed[3]) | {" "}, f"at the end: {sorted(refused['last'])}")
expect(refused["middle"] == anywhere, f"in the middle: {sorted(refused['middle'])}")
expect({"=", "[", "&", "|", ";", "`", "$"} - anywhere == {"$"}, f"refused anywhere: {sorted(anywhere)}")
for name, is_good in ((".PHONY", False), ("./-lx", False), (".//~x", False), ("sub/-lx", True), (".PHONYx", True)):
    if not is_good:
        (work / name).write_bytes(SCAN)
        expect(write_depfile([name], work, "d") == 1, f"{name} is taken")

plain = [c for c in PRINTABLE if c not in anywhere]
names = {place.replace("?", pair) for pair in [*plain, *(a + b for a in plain for b in plain)]
         for place in ("?b", "a?b", "a?")}
names = sorted(name for name in names if name[0] not in refused["first"] and name[-1] not in refused["last"])
folder = work / "all"
folder.mkdir()
for name in names:
    (folder / name).write_bytes(SCAN)
expect(write_depfile(names, folder, "out.d") == 0, "pairs of characters that are taken alone are refused")
expect(set(names) < {path.name for path in folder.iterdir()}, "a name is another file's")


def compare(tool, found):
    lost, other = sorted(set(names) - found), sorted(found - {*names, "recipe", "compiler_depend.ts"})
    expect(not lost and not other, f"{tool} does not depend on {len(lost)}: {lost[:20]}; depends on others: {other[:20]}")


def prerequisites(folder, *words):
    """What Make compares the output with, and nothing else that it does."""
    done = run("make", "--debug=v", "--dry-run", *words, folder=folder)
    return {pathlib.Path(name).name
            for name in re.findall(r"^ *Prerequisite '(.*)' is (?:older|newer) than target '.*out'\.$", done.stdout, re.M)}


(folder / "Makefile").write_text("out:\n\t@echo built\n-include out.d\n")
compare("Make", prerequisites(folder))

if shutil.which("ninja"):
    (folder / "build.ninja").write_text("rule model\n  command = cp out.d d && touch $out\n  depfile = d\n  deps = gcc\n"
                                        "build out: model\n")
    run("ninja", folder=folder)
    said = run("ninja", "-t", "deps", "out", folder=folder).stdout
    compare("Ninja", {line[4:] for line in said.splitlines() if line.startswith("    ")})
    expect("no work to do" in run("ninja", folder=folder).stdout, "Ninja builds twice")

# CMake turns the file into one for Make, and leaves it to Ninja.
project = work / "project"
project.mkdir()
(project / "CMakeLists.txt").write_text("""cmake_minimum_required(VERSION 3.21)
project(depfiles LANGUAGES NONE)
cmake_policy(SET CMP0116 OLD)
add_custom_command(OUTPUT "${CMAKE_BINARY_DIR}/out" COMMAND sh -c "cp made out.d && touch out"
    WORKING_DIRECTORY "${CMAKE_BINARY_DIR}" DEPFILE "${CMAKE_BINARY_DIR}/out.d" VERBATIM)
add_custom_target(model ALL DEPENDS "${CMAKE_BINARY_DIR}/out")
""")
for generator in ("Unix Makefiles", *(["Ninja"] if shutil.which("ninja") else [])):
    build = work / generator
    run("cmake", "-S", project, "-B", build, "-G", generator)
    target = "out" if generator == "Ninja" else build / "out"
    expect(write_depfile(names, folder, build / "made", target, folder / "recipe") == 0, generator)
    for _ in range(2):  # Makefiles take the dependencies before the second build
        said = run("cmake", "--build", build).stdout
    if generator == "Ninja":
        expect("no work to do" in said, f"CMake with Ninja builds twice: {said}")
        for c in "$# ":  # those with an escape; Ninja reads the file itself
            os.utime(folder / f"a{c}b", (2**31 - 10, 2**31 - 10))
            expect("Generating" in run("cmake", "--build", build).stdout, f"CMake with Ninja does not see a{c}b")
            os.utime(folder / f"a{c}b", (1, 1))
            run("cmake", "--build", build)
    else:
        compare("CMake with Makefiles", prerequisites(build))

if shutil.which("meson") and shutil.which("ninja"):
    project = work / "meson"
    project.mkdir()
    (project / "made").write_bytes((work / "Ninja/made").read_bytes())
    (project / "meson.build").write_text("""project('depfiles')
custom_target('model', output: 'out', depfile: 'out.d', build_by_default: true,
  command: ['sh', '-c', 'cp "$1" "$2" && touch "$3"', 'sh', files('made'), '@DEPFILE@', '@OUTPUT@'])
""")
    run("meson", "setup", "build", folder=project)
    run("ninja", "-C", "build", folder=project)
    said = run("ninja", "-C", "build", "-t", "deps", "out", folder=project).stdout
    compare("Meson", {pathlib.Path(line).name for line in said.splitlines() if line.startswith("    ")} - {"made"})

print("\n".join(faults + [f"{len(names)} names, {len(faults)} faults"]))
sys.exit(1 if faults else 0)
