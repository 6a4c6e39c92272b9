#!/usr/bin/env python3
"""pbm_add_asset builds again when a missing file appears, when a file is removed, and with another version of pbm-build
whose file has an old time, and builds nothing twice; a name that a shell would take for a pattern is refused:
check_cmake.py ROOT PROGRAMS WORK"""

import os
import pathlib
import shutil
import subprocess
import sys

import scans

root, programs, work = (pathlib.Path(word).resolve() for word in sys.argv[1:])
work = work / "cmake"
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
faults = []
PROGRAM = work / "pbm-build"


def expect(condition, what):
    if not condition:
        faults.append(what)


def run(*words, fails=False):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if (done.returncode != 0) != fails:
        sys.exit(f"{' '.join(map(str, words))}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def install(version):
    """A pbm-build of this version that notes the builds it is called for."""
    PROGRAM.write_text(f"""#!/bin/sh
[ "$1" = --version ] && echo "pbm-build {version}" && exit
echo "$*" >>{work}/calls
exec {programs}/pbm-build "$@"
""")
    PROGRAM.chmod(0o755)
    os.utime(PROGRAM, (0, 0))


def calls():
    log = work / "calls"
    count = len(log.read_text().splitlines()) if log.exists() else 0
    log.unlink(missing_ok=True)
    return count


def write_project(folder, assets):
    folder.mkdir(exist_ok=True)
    (folder / "CMakeLists.txt").write_text(f"""cmake_minimum_required(VERSION 3.21)
project(assets LANGUAGES NONE)
add_executable(pbm::pbm-build IMPORTED GLOBAL)
set_target_properties(pbm::pbm-build PROPERTIES IMPORTED_LOCATION "{PROGRAM}")
include("{root}/cmake/PbmAddAsset.cmake")
{assets}
""")


source = work / "source"
for generator in ("Ninja", "Unix Makefiles"):
    if generator == "Ninja" and not shutil.which("ninja"):
        continue
    write_project(source, "pbm_add_asset(scan SOURCES scan.obj OPTIONS --depth 6)")
    scans.write_obj(source)
    install("1")
    build = work / generator
    run("cmake", "-S", source, "-B", build, "-G", generator)

    def model_now():
        run("cmake", "--build", build)
        return (build / "scan.pbvg").read_bytes()

    first = model_now()
    model_now()  # Makefiles take the dependencies before the second build
    calls()
    model_now()
    expect(calls() == 0, f"{generator}: builds twice")
    (source / "b.png").rename(source / "away")
    without = model_now()
    expect(without != first, f"{generator}: a file that is gone is not seen")
    expect(model_now() == without, f"{generator}: a missing file changes the model")
    os.utime(source / "away", (1, 1))
    (source / "away").rename(source / "b.png")
    expect(model_now() == first, f"{generator}: a file that appears is not seen")
    model_now()
    calls()
    model_now()
    # CMake's Makefiles forget no dependency of an earlier build, nor that a file was missing.
    expect(calls() == 0 or generator != "Ninja", f"{generator}: builds twice when the file is there again")
    install("2")
    model_now()
    expect(calls() == 1, f"{generator}: another version does not build")

# "scan[1].ply" is "scan1.ply" for a shell.
(source / "scan1.ply").write_bytes(scans.ply(1))
(source / "scan[1].ply").write_bytes(scans.ply(2))
for words in ('SOURCES "scan[1].ply"', 'SOURCES scan1.ply OUTPUT "scan[1].pbvg"', 'RECIPE "{a,b}.toml"',
              'SOURCES scan1.ply OPTIONS --grid-like "like[1].pbvg"'):
    write_project(source, f"pbm_add_asset(scan {words})")
    said = run("cmake", "-S", source, "-B", work / "refused", fails=True)
    expect("pattern of names" in " ".join(said.split()), f"{words}: {said}")
write_project(source, 'pbm_add_asset(scan SOURCES scan1.ply OPTIONS --name "A lion [marble]")')
run("cmake", "-S", source, "-B", work / "quoted")
run("cmake", "--build", work / "quoted")
expect("A lion [marble]" in run(programs / "pbm-info", work / "quoted/scan.pbvg"), "a word with a blank is not kept")

print("\n".join(faults + [f"{len(faults)} faults"]))
sys.exit(1 if faults else 0)
