#!/usr/bin/env bash
# Sets everything up and walks from a scan to a picture: demo.sh [VERTICES [FOLDER]]
# Makes the sample scan, builds a .pbvg from it, validates it, draws it; ends with the numbers and how to see it in a window.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
vertices=${1:-1000000}
out=${2:-out}

scripts/install_packages.sh all
cmake --preset release >/dev/null
cmake --build --preset release -j "$(nproc)" --target man sample_model # all that is installed
bin=build/release/bin
mkdir -p "$out"
scan=$out/ammonite_$vertices.ply
model=$out/ammonite_$vertices.pbvg
picture=$out/ammonite_$vertices.png

[ -f "$scan" ] || { "$bin/pbm-sample" --vertices "$vertices" -o "$scan.part" && mv "$scan.part" "$scan"; }
seconds() { date +%s.%N; }
start=$(seconds)
"$bin/pbm-build" "$scan" -o "$model"
built=$(seconds)
"$bin/pbm-validate" "$model"
validated=$(seconds)
"$bin/pbm-render" "$model" -o "$picture" --resolution 1280,720
drawn=$(seconds)

"$bin/pbm-info" --json="$out/info.json" "$model"
python3 - "$scan" "$out/info.json" "$start" "$built" "$validated" "$drawn" "$picture" "$model" <<'PY'
import json, os, sys

scan, info, start, built, validated, drawn, picture, model = sys.argv[1:]
info = json.load(open(info))
bytes_in, bytes_out = os.path.getsize(scan), info["file_bytes"]
rows = [
    ("points", f"{info['points']:,} (depth {info['depth']})"),
    ("file", f"{bytes_out:,} bytes: {model}"),
    ("bits per point", f"{8 * bytes_out / info['points']:.2f}"),
    ("ratio to the PLY", f"{bytes_out / bytes_in:.3f} ({bytes_in:,} bytes)"),
    ("time to build", f"{float(built) - float(start):.2f} s"),
    ("time to picture", f"{float(drawn) - float(validated):.3f} s"),
    ("picture", picture),
]
print()
for name, value in rows:
    print(f"{name:18}{value}")
PY
echo "to look at it from all sides: $bin/pbm-view $model"
