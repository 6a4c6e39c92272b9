#!/usr/bin/env python3
"""The example of a build system builds, builds nothing twice, and builds again what has changed, what appears and what
disappears, and with another version of the program: check_examples.py make|ninja|meson|bazel ROOT PROGRAMS WORK"""

import ast
import atexit
import os
import pathlib
import shutil
import subprocess
import sys

tool = sys.argv[1]
root, programs, work = (pathlib.Path(word).resolve() for word in sys.argv[2:])
environment = {**os.environ, "PATH": f"{work / tool}/program:{programs}:{os.environ['PATH']}"}
source = work / tool / "examples/assets"
output = source / {"meson": "build/cube.pbvg", "bazel": "bazel-bin/cube.pbvg"}.get(tool, "cube.pbvg")
# The server ends with the test, or soon after.
BAZEL = ["bazel", f"--output_user_root={work}/bazel_root", "--max_idle_secs=30"]
NOTHING_TO_DO = "1 process: 1 internal"  # Bazel's, which only looks


def run(*command, fails=False):
    done = subprocess.run([str(word) for word in command], cwd=source, env=environment, capture_output=True, text=True)
    if (done.returncode != 0) != fails:
        sys.exit(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def build(fails=False):
    commands = {
        "make": ["make"],
        "ninja": ["ninja"],
        "meson": ["ninja", "-C", "build"],
        "bazel": [*BAZEL, "build", "//:all"],
    }
    return run(*commands[tool], fails=fails)


def install(version):
    """A pbm-build that notes the builds it is called for, and says that it has this version."""
    program = work / tool / "program/pbm-build"
    program.parent.mkdir(exist_ok=True)
    program.write_text(f"""#!/bin/sh
if [ "$1" = --version ]; then
    echo "pbm-build {version}"
    exit
fi
[ -w {work / tool} ] && echo "$*" >>{work / tool}/calls
exec {programs}/pbm-build "$@"
""")
    program.chmod(0o755)
    os.utime(program, (0, 0))  # as a package may have it


def calls():
    """Builds since the last call."""
    log = work / tool / "calls"
    count = len(log.read_text().splitlines()) if log.exists() else 0
    log.unlink(missing_ok=True)
    return count


def expect(condition, what):
    if not condition:
        sys.exit(f"{tool}: {what}")


def parse_starlark():
    """Bazel 4 does not read MODULE.bazel. The syntax of Starlark is a part of Python's."""
    files = [file for folder in ("bazel", "examples/assets") for file in sorted((root / folder).iterdir())
             if file.suffix in (".bzl", ".bazel") or file.name == "WORKSPACE"]
    expect(len(files) == 8, f"there are {len(files)} files for Bazel")
    calls = set()
    for file in files:
        tree = ast.parse(file.read_text(), str(file))
        calls |= {node.func.id for node in ast.walk(tree)
                  if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and file.name == "MODULE.bazel"}
    expect(calls == {"module", "use_extension", "use_repo", "bazel_dep", "local_path_override"}, f"MODULE.bazel: {calls}")


if tool == "bazel":
    parse_starlark()
if not shutil.which(tool) or not shutil.which("ninja"):
    print(f"skipped: {tool} is not installed")
    sys.exit(77)

if (work / tool).exists():
    shutil.rmtree(work / tool)
shutil.copytree(root / "examples/assets", source)
shutil.copytree(root / "bazel", work / tool / "bazel")
install("1")
if tool == "meson":
    run("meson", "setup", "build")
if tool == "bazel":
    atexit.register(run, *BAZEL, "shutdown")
build()
model = output.read_bytes()
run("pbm-validate", output)
if tool == "bazel":
    expect((output.parent / "models/cube.pbvg").read_bytes() == model, "recipe and options give two models")
time = output.stat().st_mtime_ns
calls()
said = build()
expect((NOTHING_TO_DO in said if tool == "bazel" else calls() == 0) and output.stat().st_mtime_ns == time,
       f"builds twice:\n{said}")

# A file that the scan names, which the build file does not.
materials = source / "cube.mtl"
materials.write_text(materials.read_text().replace("0.8 0.1 0.1", "0.1 0.1 0.8"))
os.utime(materials, ns=(time + 10**9, time + 10**9))
build()
blue = output.read_bytes()
expect(blue != model, "a change of a material file is not seen")

if tool != "bazel":  # which knows no files but those that its rule names
    # A file that disappears, and appears again, older than the model.
    saved = work / tool / "saved"
    materials.rename(saved)
    build()
    without = output.read_bytes()
    expect(without != blue, "a material file that is gone is not seen")
    for _ in range(2):
        build()
    expect(output.read_bytes() == without, "a material file that is not there changes the model")
    saved.rename(materials)
    os.utime(materials, (0, 0))
    build()
    expect(output.read_bytes() == blue, "a material file that appears is not seen")
    build()
    calls()
    build()
    expect(calls() == 0, "builds twice when the material file is there again")

    # Another version of the program, whose file has an old time.
    install("2")
    build()
    expect(calls() == 1, "another version of the program does not build")
    build()
    expect(tool == "make" or calls() == 0, "builds twice with another version")  # Make compares times only

# What fails leaves the old model.
scan = source / "cube.obj"
scan.write_text(scan.read_text().replace("f 1 4 3 2", "f 1 4 3 99"))
os.utime(scan, ns=(time + 60 * 10**9, time + 60 * 10**9))
said = build(fails=True)
expect("cube.obj" in said and "99" in said, f"the reason is not said:\n{said}")
if tool != "bazel":  # which removes outputs before an action
    expect(output.read_bytes() == blue, "a failure damages the model")
