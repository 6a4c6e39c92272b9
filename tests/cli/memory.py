#!/usr/bin/env python3
"""--max-memory of pbm-build and pbm-validate: the same bytes and verdicts in less memory, and temporary files without
names: memory.py PROGRAMS WORK_FOLDER"""

import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import time

MEGA = 1 << 20
failed = []


def check(condition, message):
    if not condition:
        failed.append(message)


def run(*command, data=resource.RLIM_INFINITY):
    """Exit code, what it said, and its largest resident memory. `data`: bytes of its own that the system gives it."""
    process = subprocess.Popen([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (data, data)))
    said = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    return os.waitstatus_to_exitcode(status), said, usage.ru_maxrss * 1024


def check_validation(programs):
    """A check holds a few chunks at a time, of any model. The system's limit leaves out the pages of the mapped file."""
    subprocess.run([programs / "pbm-build", "scan.ply", "-q", "--depth", "11", "-o", "model.pbvg"], check=True)
    with open("model.pbvg", "rb") as file:
        decoded = int.from_bytes(file.read(72)[64:], "little")
    validate = [programs / "pbm-validate", "-j", "1", "model.pbvg"]
    for level in ([], ["--deep"]):
        code, verdict, _ = run(*validate, *level)
        print(verdict.strip(), f"{decoded / MEGA:.0f} MB decoded")
        check(code == 0 and verdict.startswith("VALID"), f"{level}: {code} {verdict}")
        for limit in (8 * MEGA, 24 * MEGA):
            code, said, _ = run(*validate, *level, "--max-memory", str(limit), data=limit + limit // 4 + 2 * MEGA)
            check(code == 0 and said == verdict, f"another verdict within {limit}: {code} {said}")
            check(decoded > 4 * limit, "the model is too small for this test")
    code, said, _ = run(*validate, "--max-memory", str(8 * MEGA), data=3 * MEGA)
    check(code == 4 and "out of memory" in said, f"the system gives more than its limit: {code} {said}")
    code, said, _ = run(*validate, "--max-memory", "500k")
    check(code == 4 and "the model needs" in said, f"500k: {code} {said}")


def main():
    programs, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "temporary").mkdir(parents=True)
    os.chdir(folder)
    subprocess.run([programs / "pbm-sample", "-q", "--vertices", "700000", "-o", "scan.ply"], check=True)
    subprocess.run([programs / "pbm-sample", "-q", "--shape", "statue", "--points", "1000000", "-o", "cloud.ply"],
                   check=True)
    for scan, options, limit in (("cloud.ply", [], 150 * MEGA), ("scan.ply", ["--depth", "11"], 250 * MEGA)):
        limited = ["--max-memory", str(limit), "--temp-dir", "temporary"]
        build = [programs / "pbm-build", scan, "-q", *options]
        code, said, whole = run(*build, "-o", "whole.pbvg")
        check(code == 0 and not said, f"without a limit: {code} {said}")
        # The system refuses memory that does not lie in files beyond the limit.
        code, said, peak = run(*build, *limited, "-o", "limited.pbvg", data=limit)
        print(f"{scan}: peak {whole / MEGA:.0f} MB, with a limit of {limit / MEGA:.0f} MB {peak / MEGA:.0f} MB")
        check(code == 0 and not said, f"with a limit: {code} {said}")
        check(pathlib.Path("whole.pbvg").read_bytes() == pathlib.Path("limited.pbvg").read_bytes(), "other bytes")
        check(peak <= limit, f"{scan}: the limit does not hold: {peak}")
        check(not os.listdir("temporary"), "temporary files are left")
    build = [programs / "pbm-build", "scan.ply", "-q", "--depth", "11"]
    code, said, _ = run(*build, "-o", "limited.pbvg", data=limit)
    check(code == 4 and "out of memory" in said, f"the build fits without a limit: {code} {said}")

    # A build that is killed leaves nothing either.
    process = subprocess.Popen([str(c) for c in (*build, *limited, "-o", "limited.pbvg")])
    maps = pathlib.Path(f"/proc/{process.pid}/maps")
    while process.poll() is None and "temporary" not in maps.read_text():
        time.sleep(0.001)
    check(not os.listdir("temporary"), "a temporary file has a name")
    process.send_signal(signal.SIGKILL)
    process.wait()
    check(not os.listdir("temporary"), "temporary files of a killed build are left")

    code, said, _ = run(*build, "--max-memory", "1G", "--temp-dir", "none", "-o", "x.pbvg")
    check(code == 2 and "--temp-dir none: cannot make a temporary file" in said, f"no folder: {code} {said}")

    check_validation(programs)
    print("\n".join(failed))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
