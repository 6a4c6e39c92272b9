#!/usr/bin/env python3
"""Where the time of pbm-build goes, one scan after the other.  usage: build_steps.py BIN SCAN... [-- BUILD OPTIONS]"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile


def main():
    programs = pathlib.Path(sys.argv[1])
    scans, options = sys.argv[2:], []
    if "--" in scans:
        cut = scans.index("--")
        scans, options = scans[:cut], scans[cut + 1:]
    with tempfile.TemporaryDirectory() as name:
        model = os.path.join(name, "model.bvg")
        for scan in scans:
            run = subprocess.run([programs / "pbm-build", scan, "-o", model, "--json", *options], check=True, capture_output=True)
            result = json.loads(run.stdout)
            total = sum(step["seconds"] for step in result["steps"])
            read = next(step["seconds"] for step in result["steps"] if step["name"] == "read")
            print(f"{os.path.basename(scan)}: {result['vertices'] / read / 1e6:.1f} M vertices/s read, "
                  f"{result['points'] / total / 1e6:.2f} M points/s in all")
            for step in result["steps"]:
                print(f"    {step['name']:16}{step['seconds']:8.3f} s  {100 * step['seconds'] / total:5.1f} %"
                      f"  {step['peak_memory'] / 2**20:8.0f} MiB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
