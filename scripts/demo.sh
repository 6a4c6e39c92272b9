#!/usr/bin/env bash
# Sets up what it needs and walks from a scan to a picture: demo.sh [VERTICES [FOLDER]]
# Makes the sample scan, builds a .pbvg from it, validates it, draws it; ends with the numbers. Where there is a display it
# builds pbm-view too. All else (tests, pbm-export, man pages) is left to scripts/test.sh and `cmake --preset release`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
vertices=${1:-1000000}
out=${2:-out}

scripts/install_packages.sh demo
programs=(pbm-{sample,build,validate,render,info})
# What scripts/test.sh has configured stays as it is.
[ -f build/release/CMakeCache.txt ] || cmake --preset release -DPBM_UNITY=ON -DPBM_BUILD_TESTS=OFF \
    -DPBM_BUILD_VIEWER=OFF -DCMAKE_PREFIX_PATH="$PWD/build/packages/usr" >/dev/null
if [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then
    scripts/install_packages.sh viewer
    cmake build/release -DPBM_BUILD_VIEWER=ON >/dev/null
    programs+=(pbm-view)
fi
cmake --build --preset release -j "$(nproc)" --target "${programs[@]}"
bin=build/release/bin
mkdir -p "$out"
scan=$out/ammonite_$vertices.ply
model=$out/ammonite_$vertices.pbvg
picture=$out/ammonite_$vertices.png

[ -f "$scan" ] || { "$bin/pbm-sample" --vertices "$vertices" -o "$scan.part" && mv "$scan.part" "$scan"; }
start=$EPOCHREALTIME
"$bin/pbm-build" "$scan" -o "$model"
built=$EPOCHREALTIME
"$bin/pbm-validate" "$model"
validated=$EPOCHREALTIME
"$bin/pbm-render" "$model" -o "$picture" --resolution 1280,720
drawn=$EPOCHREALTIME

info=$("$bin/pbm-info" --json "$model")
info() { sed -n "s/^  \"$1\": \([0-9]*\),\?$/\1/p" <<<"$info"; }
echo
awk -v points="$(info points)" -v depth="$(info depth)" -v bytes="$(info file_bytes)" \
    -v input="$(stat -c %s "$scan")" -v build="${built/,/.} ${start/,/.}" -v draw="${drawn/,/.} ${validated/,/.}" \
    -v model="$model" -v picture="$picture" 'BEGIN {
    split(build, b); split(draw, d)
    printf "%-18s%.0f (depth %d)\n", "points", points, depth
    printf "%-18s%.0f bytes: %s\n", "file", bytes, model
    printf "%-18s%.2f\n", "bits per point", 8 * bytes / points
    printf "%-18s%.3f (%.0f bytes)\n", "ratio to the PLY", bytes / input, input
    printf "%-18s%.2f s\n", "time to build", b[1] - b[2]
    printf "%-18s%.3f s\n", "time to picture", d[1] - d[2]
    printf "%-18s%s\n", "picture", picture
}'
[ -z "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ] || echo "to look at it from all sides: $bin/pbm-view $model"
