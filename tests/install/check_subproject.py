#!/usr/bin/env python3
"""PBM as a part of another project, without presets, in folders whose names have spaces:
check_subproject.py --cmake CMAKE --source PBM --work FOLDER --compiler C++ [--build-type TYPE] [--everything]

Configures subproject/ with the whole of PBM, and builds the libraries of the run time and the readers of scans, several
files at a time. --everything builds the programs too, and every file alone. Warnings are errors. With clang, plain char is
unsigned, as on ARM (g++ 12 then compiles blends of vectors wrongly). PBM adds no test, no rule for installation, and no
target with a common name.
"""
import argparse
import os
import pathlib
import shutil
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from commands import check, must  # noqa: E402

PROGRAMS = ("pbm-build", "pbm-render", "pbm-view", "pbm-validate", "pbm-info", "pbm-export", "pbm-sample")

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
for name in ("cmake", "source", "work", "compiler"):
    parser.add_argument("--" + name, required=True)
parser.add_argument("--build-type", default="")
parser.add_argument("--everything", action="store_true")
arguments = parser.parse_args()
if not shutil.which(arguments.compiler):
    print(f"skipped: {arguments.compiler} is not installed")
    sys.exit(77)

work = pathlib.Path(arguments.work).resolve() / f"a folder of {arguments.compiler}"
source, build, prefix = work / "the sources", work / "the build", work / "installed"
build.mkdir(parents=True, exist_ok=True)
source.unlink(missing_ok=True)
source.symlink_to(pathlib.Path(arguments.source).resolve())

options = {"CMAKE_CXX_COMPILER": arguments.compiler, "CMAKE_BUILD_TYPE": arguments.build_type, "PBM_SOURCE": source,
           "CMAKE_CXX_FLAGS": "-funsigned-char" if "clang" in arguments.compiler else "", "PBM_WARNINGS_AS_ERRORS": "ON",
           "PBM_UNITY": "OFF" if arguments.everything else "ON", "PBM_SIMD_TARGETS": "HWY_AVX2", "PBM_SAMPLE_VERTICES": "20000"}
must(arguments.cmake, "-S", HERE / "subproject", "-B", build, "-G", "Ninja",
     *(f"-D{name}={value}" for name, value in options.items()))
targets = () if arguments.everything else ("--target", "read_points", "draw_picture", "pbm_scan")
must(arguments.cmake, "--build", build, "--parallel", os.cpu_count(), *targets)

model = source / "format_spec/golden/1.0/scan-everything.pbvg"
picture = work / "picture.ppm"
check(len(must(build / "read_points", model, "3").splitlines()) > 10, "read_points printed no points")
must(build / "draw_picture", model, picture)
check(picture.read_bytes().startswith(b"P6\n640 480\n255\n"), "draw_picture drew nothing")

listed = must(pathlib.Path(arguments.cmake).with_name("ctest"), "--test-dir", build, "--show-only")
check("Total Tests: 0" in listed, f"PBM added tests:\n{listed}")
if arguments.everything:
    must(arguments.cmake, "--install", build, "--prefix", prefix)
    check(not any(prefix.rglob("*")), "PBM installs files with the other project")
    programs = build / "pbm" / "bin"
    for program in PROGRAMS:
        check(program in must(programs / program, "--help"), f"{program} --help does not name itself")
    must(programs / "pbm-validate", build / "an asset.pbvg")
print(f"built with {arguments.compiler}: {'everything' if arguments.everything else 'the run time and the readers'}")
