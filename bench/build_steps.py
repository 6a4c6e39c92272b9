#!/usr/bin/env python3
"""Where the time of pbm-build goes, one scan after the other: the least of some runs.
usage: build_steps.py BIN [--runs N] SCAN... [-- BUILD OPTIONS], for figures per core with -- -j 1"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile


def build(command):
    """What one build says of itself, and the seconds that the processor worked on it."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        text = process.stdout.read()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit code {process.returncode}")
    return json.loads(text), used.ru_utime + used.ru_stime


def main():
    programs = pathlib.Path(sys.argv[1])
    scans, options, runs = sys.argv[2:], [], 3
    if "--" in scans:
        cut = scans.index("--")
        scans, options = scans[:cut], scans[cut + 1:]
    if scans[0] == "--runs":
        runs, scans = int(scans[1]), scans[2:]
    with tempfile.TemporaryDirectory() as name:
        model = os.path.join(name, "model.pbvg")
        for scan in scans:
            results = [build([programs / "pbm-build", scan, "-o", model, "--json", *options]) for _ in range(runs)]
            result, processor = results[0][0], min(seconds for _, seconds in results)
            points = result["points"]
            steps = {step["name"]: min(next(s["seconds"] for s in other["steps"] if s["name"] == step["name"])
                                       for other, _ in results) for step in result["steps"]}
            total = sum(steps.values())
            print(f"{os.path.basename(scan)}: {points} points at depth {result['depth']}, "
                  f"{result['samples'] / points:.2f} samples per point, {result['vertices'] / steps['read'] / 1e6:.1f} M vertices/s read, "
                  f"{points / total / 1e6:.2f} M points/s in all, {points / processor / 1e6:.2f} per second of a core")
            for step in result["steps"]:
                seconds = steps[step["name"]]
                print(f"    {step['name']:16}{seconds:8.3f} s  {1e9 * seconds / points:7.0f} ns/point  {100 * seconds / total:5.1f} %"
                      f"  {step['peak_memory'] / 2**20:8.0f} MiB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
