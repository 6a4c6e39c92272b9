#!/usr/bin/env python3
"""Bits per point of masks and normals (zstd -19) of the sample scan beside a real scan, depth by depth.
usage: roughness.py BIN SCAN.ply [VERTICES]; exit code 1 if the sample compresses better anywhere."""
import json
import pathlib
import subprocess
import sys
import tempfile


def bits_per_point(programs, scan, depth, folder):
    model = folder / "model.pbvg"
    subprocess.run([programs / "pbm-build", scan, "-o", model, "--depth", str(depth), "-z", "19", "-q"], check=True)
    info = json.loads(subprocess.run([programs / "pbm-info", "--json", model], check=True, capture_output=True).stdout)
    return {s["type"]: 8 * s["stored_bytes"] / info["points"] for s in info["streams"]}


def main():
    programs, scan = pathlib.Path(sys.argv[1]), sys.argv[2]
    vertices = sys.argv[3] if len(sys.argv) > 3 else "1000000"
    smoother = False
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        sample = folder / "sample.ply"
        subprocess.run([programs / "pbm-sample", "-q", "--vertices", vertices, "-o", sample], check=True)
        print("depth  stream      scan    sample")
        for depth in (8, 9, 10):
            real, ours = (bits_per_point(programs, path, depth, folder) for path in (scan, sample))
            for stream in ("masks", "normal"):
                smoother |= ours[stream] < real[stream]
                print(f"{depth:5}  {stream:8}{real[stream]:8.3f}  {ours[stream]:8.3f}")
    return 1 if smoother else 0


if __name__ == "__main__":
    sys.exit(main())
