#!/usr/bin/env python3
"""Instructions per point of one frame of the reference renderer, counted by callgrind: the same on every run.
usage: instructions.py BIN MODEL.bvg [pbm-render options]"""
import json
import pathlib
import subprocess
import sys
import tempfile


def main():
    program, model, options = pathlib.Path(sys.argv[1]) / "pbm-render", sys.argv[2], sys.argv[3:]
    with tempfile.TemporaryDirectory() as name:
        # Only what happens inside ReferenceRenderer::render is counted.
        run = subprocess.run(
            ["valgrind", "--tool=callgrind", "--collect-atstart=no", "--toggle-collect=pbm::ReferenceRenderer::render*",
             f"--callgrind-out-file={name}/out", program, model, "-o", f"{name}/picture.png", "-j", "1", "--json", *options],
            check=True, capture_output=True, text=True)
    statistics = json.loads(run.stdout[run.stdout.index("{"):])
    collected = next(line for line in run.stderr.splitlines() if "Collected" in line)
    instructions = int(collected.split(":")[1])
    print(f"{instructions:,} instructions, {statistics['points']:,} points: "
          f"{instructions / statistics['points']:.1f} per point ({statistics['drawn_points']:,} drawn)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
