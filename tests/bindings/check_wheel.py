#!/usr/bin/env python3
"""Makes the wheel, installs it into an empty virtual environment and uses it: check_wheel.py SOURCE_FOLDER BUILD_FOLDER

numpy is the system's. Skips where what makes a wheel is not installed.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77


def run(*command, **options):
    result = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    if result.returncode != 0:
        sys.exit(f"FAILED with {result.returncode}: {' '.join(map(str, command))}\n{result.stdout}")
    return result.stdout


def main():
    source, build = (pathlib.Path(argument).resolve() for argument in sys.argv[1:])
    modules = ["build", "wheel", "setuptools", "venv", "ensurepip", "numpy"]
    missing = [name for name in modules if subprocess.run([sys.executable, "-c", f"import {name}"], capture_output=True).returncode]
    missing += [] if shutil.which("patchelf") else ["patchelf"]
    if missing:
        print(f"not installed, skipped: {' '.join(missing)}")
        sys.exit(SKIPPED)
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        print(run("bash", source / "scripts/make_wheel.sh", build, folder / "dist", env={**os.environ, "PYTHON": sys.executable}))
        wheel, = (folder / "dist").glob("pbm_scan-*.whl")
        run(sys.executable, "-m", "venv", "--system-site-packages", folder / "venv")
        clean = {name: value for name, value in os.environ.items()
                 if not name.startswith(("PBM_", "PYTHON", "LD_LIBRARY"))} | {"PATH": f"{folder}/venv/bin:/usr/bin:/bin"}
        options = {"cwd": folder, "env": clean}
        run(folder / "venv/bin/pip", "install", "--no-index", "--disable-pip-version-check", wheel, **options)
        package = pathlib.Path(run("python", "-c", "import pbm; print(pbm.__path__[0])", **options).strip())
        if folder not in package.parents:
            sys.exit(f"FAILED: {package} is not of the wheel")
        for file in [*(package / "libs").iterdir(), *(package / "bin").iterdir()]:
            for line in run("ldd", file, **options).splitlines():
                name, _, path = line.strip().partition(" => ")
                if "not found" in line or (path and str(package) not in path
                                           and not name.startswith(("libc.", "libm.", "libstdc++.", "libgcc_s.", "ld-linux"))):
                    sys.exit(f"FAILED: {file.name} needs {line.strip()}")
        print(run("python", source / "tests/bindings/python/test_pbm.py", **options))
        scan = folder / "scan.xyz"
        scan.write_text("".join(f"{x} {y} {x * y / 50}\n" for x in range(50) for y in range(50)))
        for command in (["pbm-build", scan, "-o", "scan.pbvg"], ["pbm-info", "scan.pbvg"], ["pbm-validate", "scan.pbvg"],
                        ["pbm-render", "scan.pbvg", "-o", "scan.png"], ["pbm-export", "scan.pbvg", "-o", "points.ply"]):
            run(*command, **options)
        for name in ("scan.png", "points.ply"):
            if (folder / name).stat().st_size < 1000:
                sys.exit(f"FAILED: {name} is empty")
    print("the wheel works")


if __name__ == "__main__":
    main()
