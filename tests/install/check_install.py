#!/usr/bin/env python3
"""Installs the build into an empty prefix, then builds and runs examples/ against that prefix alone."""

import argparse
import json
import os
import pathlib
import re
import shutil
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from commands import check, must  # noqa: E402

parser = argparse.ArgumentParser(description=__doc__)
for name in ("cmake", "build", "examples", "compiler"):
    parser.add_argument("--" + name, required=True)
arguments = parser.parse_args()

MOST_HEADERS = 45  # the doors, and what they include

work = pathlib.Path(arguments.build) / "tests" / "install"
prefix, outside = work / "prefix", work / "outside"
shutil.rmtree(prefix, ignore_errors=True)
shutil.rmtree(outside, ignore_errors=True)

must(arguments.cmake, "--install", arguments.build, "--prefix", prefix)
for program in ("pbm-build", "pbm-render", "pbm-validate", "pbm-info", "pbm-export", "pbm-sample"):
    check((prefix / "bin" / program).is_file(), program + " is not installed")
    help_text = must(prefix / "bin" / program, "--help")
    check(program in help_text, f"{program} --help does not name itself")
if (prefix / "bin" / "pbm-view").exists():
    check("pbm-view" in must(prefix / "bin" / "pbm-view", "--help"), "pbm-view --help does not name itself")
    must(prefix / "bin" / "pbm-validate", prefix / "share" / "pbm" / "sample.pbvg")
check(list(prefix.glob("share/doc/*/LICENSE")), "LICENSE is not installed")
check(list(prefix.glob("share/doc/*/format_spec/BVG.md")), "BVG.md is not installed")
check(list(prefix.glob("share/doc/*/format_spec/mask_ranks.txt")), "mask_ranks.txt, a table of BVG.md, is not installed")
for name in ("man/man1/pbm-build.1", "bash-completion/completions/pbm-build", "zsh/site-functions/_pbm-build",
             "fish/vendor_completions.d/pbm-build.fish"):
    check((prefix / "share" / name).stat().st_size > 1000, f"{name} is not installed")
for name in ("failure", "pbm-build", "pbm-build-batch", "pbm-export", "pbm-info", "pbm-render", "pbm-validate", "pbm-validate-codes"):
    check((prefix / f"share/pbm/{name}.schema.json").is_file(), f"the schema of {name} is not installed")
for file in prefix.rglob("*.cmake"):
    check(arguments.build not in file.read_text(), f"{file.name} names the build folder")

# PATH of the README leads find_package to the build folder, whose package would lack its installed neighbours.
by_path = work / "by path"
shutil.rmtree(by_path, ignore_errors=True)
by_path.mkdir()
(by_path / "CMakeLists.txt").write_text("""cmake_minimum_required(VERSION 3.25)
project(by_path LANGUAGES NONE)
find_package(pbm)
message(STATUS "searched: ${pbm_CONSIDERED_CONFIGS}")
""")
programs = pathlib.Path(arguments.build) / "bin"
searched = must(arguments.cmake, "-S", by_path, "-B", by_path / "build",
                env={**os.environ, "PATH": f"{programs.resolve()}:{os.environ['PATH']}"})
check(str(pathlib.Path(arguments.build).resolve()) not in searched.partition("searched:")[2].partition("\n")[0],
      f"find_package finds the build folder: {searched}")

# Each public header begins with an example program, which examples/ contains verbatim.
for door, example in (("format", "read_points"), ("render", "moving_camera"), ("bake", "bake_sun"), ("scan", "read_scan")):
    text = (prefix / f"include/pbm/{door}.h").read_text()
    program = text[text.index("//   #include"):text.index("//   }\n") + len("//   }\n")]
    lines = [line.removeprefix("//").removeprefix("   ") for line in program.splitlines()]
    check("\n".join(lines) + "\n" == (pathlib.Path(arguments.examples) / f"{example}.cpp").read_text(),
          f"the example of pbm/{door}.h is not examples/{example}.cpp")
check(len(list((prefix / "include").glob("*"))) == 1, "headers are installed outside include/pbm")
headers = list((prefix / "include").rglob("*.h"))
check(len(headers) <= MOST_HEADERS, f"{len(headers)} headers are installed, more than {MOST_HEADERS}: what do the doors include?")
for header in headers:
    marks = re.findall(r"^// Stability: (stable|experimental)\.", header.read_text(), re.M)
    check(len(marks) == 1, f"{header.name} does not say once whether it is stable or experimental")
    check(marks == ["stable"] or header.parent != prefix / "include/pbm", f"the door {header.name} is not stable")
highway = [str(file) for file in prefix.rglob("*.h") if "hwy/" in file.read_text()]
check(not highway, f"installed headers need Highway: {highway}")

# A copy outside the source tree cannot use its headers and targets.
shutil.copytree(arguments.examples, outside)
must(arguments.cmake, "-S", outside, "-B", outside / "build", "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}",
    f"-DCMAKE_CXX_COMPILER={arguments.compiler}", "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror")
must(arguments.cmake, "--build", outside / "build")
# Whoever does not read scans needs none of the libraries of the readers.
must(arguments.cmake, "-S", outside, "-B", outside / "without", f"-DCMAKE_PREFIX_PATH={prefix}",
     f"-DCMAKE_CXX_COMPILER={arguments.compiler}", "-DCMAKE_DISABLE_FIND_PACKAGE_draco=ON")

scan, model, picture = work / "sample.ply", work / "sample.pbvg", work / "sample.ppm"
must(prefix / "bin" / "pbm-sample", "--vertices", "10000", "-o", scan)
must(prefix / "bin" / "pbm-build", "-q", "--depth", "7", scan, "-o", model)
info = json.loads(must(prefix / "bin" / "pbm-info", "--json", model))

points = [tuple(map(float, line.split())) for line in must(outside / "build" / "read_points", model).splitlines()]
check(len(points) == info["points"], f"read_points printed {len(points)} points, pbm-info says {info['points']}")
check(len(set(points)) == len(points), "read_points printed a point twice")
check(len(must(outside / "build" / "read_points", model, "1").splitlines()) <= 8, "level 1 has more than eight points")

must(outside / "build" / "draw_picture", model, picture)
header = b"P6\n640 480\n255\n"
pixels = picture.read_bytes()
check(pixels.startswith(header) and len(pixels) == len(header) + 640 * 480 * 3, "draw_picture wrote no picture")
drawn = sum(pixels[i : i + 3] != b"\x33\x33\x33" for i in range(len(header), len(pixels), 3))
check(drawn > 640 * 480 // 10, f"only {drawn} pixels are drawn")
frames = must(outside / "build" / "moving_camera", model).splitlines()
check(len(frames) == 8 and all(int(frame.split()[2]) > 0 for frame in frames), "moving_camera drew no points")
fine = work / "fine.pbvg" # many chunks, of which a close-up needs some
must(prefix / "bin" / "pbm-build", "-q", "--depth", "9", scan, "-o", fine)
passes = must(outside / "build" / "draw_by_ranges", fine).splitlines()
fetched, size = (int(number) for number in passes[-1].split()[2:5:2])
check(len(passes) > 1 and fetched < size, f"draw_by_ranges fetched {fetched} of {size} bytes in {len(passes)} passes")

if (prefix / "include/pbm/pbm.h").exists(): # the same in C: by CMake, by pkg-config, and linked statically
    c, drawn_in_c = outside / "c", []
    packages = next(prefix.rglob("pbm.pc")).parent
    environment = {**os.environ, "PKG_CONFIG_PATH": str(packages), "LD_LIBRARY_PATH": str(packages.parent)}
    must(arguments.cmake, "-S", c, "-B", c / "build", "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}")
    must(arguments.cmake, "--build", c / "build")
    must("make", "-C", c, env=environment)
    words = must("pkg-config", "--cflags", "--libs", "--static", "pbm", env=environment).replace("-lpbm", "-l:libpbm.a").split()
    must("cc", "-std=c99", c / "draw_model.c", "-o", c / "draw_statically", *words)
    (c / "all.c").write_text("#include <pbm/pbm.h>\nint main(void) { return pbm_build(0, 0, 0, 0) != PBM_USAGE; }\n")
    must("cc", c / "all.c", "-o", c / "all_statically", *words) # with all that building needs
    must(c / "all_statically")
    for program in (c / "build" / "draw_model", c / "draw_model", c / "draw_statically"):
        must(program, model, picture, env=environment)
        drawn_in_c.append(picture.read_bytes())
    check(len(set(drawn_in_c)) == 1 and len(drawn_in_c[0]) > 640 * 480 * 3, "the pictures of draw_model differ")
    check("libpbm" not in must("ldd", c / "draw_statically"), "draw_statically needs libpbm.so")

read = outside / "build" / "read_scan"
said = must(read, scan)
vertices, faces = (line.split()[2].decode() for line in scan.read_bytes().splitlines()[:20] if line.startswith(b"element "))
check(said.startswith(f"{vertices} vertices, {faces} triangles\n"), f"read_scan says: {said}")
used = must("ldd", read) + must("nm", read)
check(not any(name in used for name in ("OpenMesh", "ZSTD_compress", "ZSTD_CCtx", "ZSTD_createCCtx")),
      "the readers need the encoder or OpenMesh")

lit = work / "lit.pbvg"
must(outside / "build" / "bake_sun", model, lit)
must(prefix / "bin" / "pbm-validate", lit)
check(json.loads(must(prefix / "bin" / "pbm-info", "--json", lit))["points"] == info["points"], "bake_sun lost points")
print(f"{len(points)} points read, {drawn} pixels drawn")
