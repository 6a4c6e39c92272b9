#!/usr/bin/env python3
"""What libpbm promises besides its behaviour.

  check_library.py header SOURCE_FOLDER LIBRARY_FOLDER MODEL   the program in pbm.h compiles as C99 and C++, and draws
  check_library.py symbols SOURCE_FOLDER LIBRARY               it exports the functions of pbm.h, versioned, and no more
  check_library.py abi SOURCE_FOLDER LIBRARY                   bindings/c/libpbm.abi describes it, types included
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from commands import check, must  # noqa: E402

SKIPPED = 77


def run(*command, **options):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, **options)


def declared(source):
    return sorted(re.findall(r"^PBM_API .*?(pbm_\w+)\(", (source / "bindings/c/pbm.h").read_text(), re.MULTILINE))


def header(source, libraries, model):
    text = (source / "bindings/c/pbm.h").read_text()
    program = text[text.index("//   #include"):text.index("//   }\n//\n// Contents") + len("//   }\n")]
    lines = [line.removeprefix("//").removeprefix("   ") for line in program.splitlines()]
    example = source / "examples/c/draw_model.c"
    check("\n".join(lines) + "\n" == example.read_text(), f"the program of pbm.h is not {example}")
    strict = ["-pedantic", "-Wall", "-Wextra", "-Werror", f"-I{libraries}/include", f"-L{libraries}"]
    with tempfile.TemporaryDirectory() as folder:
        pictures = []
        for name, compiler in (("c", ["cc", "-std=c99"]), ("cpp", ["c++", "-std=c++11", "-x", "c++"])):
            binary, picture = pathlib.Path(folder) / name, pathlib.Path(folder) / f"{name}.ppm"
            must(*compiler, *strict, example, "-x", "none", "-o", binary, "-lpbm")
            environment = {**os.environ, "LD_LIBRARY_PATH": str(libraries)}
            must(binary, model, picture, env=environment)
            failed = run(binary, model + ".nowhere", picture, env=environment)
            check(failed.returncode == 2 and failed.stderr.count("\n") == 1, f"no I/O error: {failed}")
            pictures.append(picture.read_bytes())
    check(pictures[0].startswith(b"P6 640 480 255\n") and len(pictures[0]) == 15 + 3 * 640 * 480, "no picture")
    check(pictures[0] == pictures[1] and len(set(pictures[0])) > 50, "the pictures differ, or show nothing")


def symbols(source, library):
    functions = declared(source)
    check(len(functions) > 15, f"pbm.h declares {functions}")
    listed = sorted(re.findall(r"^    (pbm_\w+);", (source / "bindings/c/libpbm.map").read_text(), re.MULTILINE))
    check(functions == listed, f"libpbm.map lists {listed}, pbm.h declares {functions}")
    exported = sorted(line.split()[-1] for line in must("nm", "-D", "--defined-only", library).splitlines()
                      if line.split()[-1] != "PBM_1.0")
    check(exported == [name + "@@PBM_1.0" for name in functions], f"exported: {exported}")
    dynamic = must("readelf", "-d", library)
    check("soname: [libpbm.so.1]" in dynamic, "the soname is not libpbm.so.1:\n" + dynamic)
    used = {line.split()[-1].split("@")[0] for line in must("nm", "-D", "--undefined-only", library).splitlines()}
    found = used & {"exit", "quick_exit", "puts", "putchar", "printf", "perror", "_ZSt4cout", "_ZSt4cerr", "setlocale",
                    "sigaction", "mallopt", "pthread_setattr_default_np"}
    check(not found, f"the library uses {sorted(found)}, which are of programs")


def abi(source, library):
    if shutil.which("abidiff") is None:
        print("abidiff is not installed (abigail-tools): skipped")
        sys.exit(SKIPPED)
    dump = source / "bindings/c/libpbm.abi"
    result = run("abidiff", "--exported-interfaces-only", dump, library)
    if result.returncode != 0:
        sys.exit(f"{result.stdout}{result.stderr}FAILED: the binary interface is not that of {dump}. Where it has only "
                 f"become larger:\n  abidw --exported-interfaces-only --no-show-locs --no-elf-needed --no-corpus-path "
                 f"--no-comp-dir-path --out-file {dump} {library}")


def main():
    modes = {"header": header, "symbols": symbols, "abi": abi}
    if len(sys.argv) < 4 or sys.argv[1] not in modes:
        sys.exit(__doc__)
    modes[sys.argv[1]](pathlib.Path(sys.argv[2]), *sys.argv[3:])


if __name__ == "__main__":
    main()
