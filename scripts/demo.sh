#!/usr/bin/env bash
# Sets up what it needs and walks from a scan to a picture: demo.sh [--viewer] [VERTICES [FOLDER]]
# Makes the sample scan, builds a .pbvg from it, validates it, draws it; ends with the numbers. Where there is a display, or
# with --viewer, it builds pbm-view too. It builds for this machine alone: other SIMD targets, other programs, tests and man
# pages are left to scripts/test.sh and `cmake --preset release`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
viewer=${DISPLAY:-}${WAYLAND_DISPLAY:-}
if [ "${1:-}" = --viewer ]; then
    viewer=$1
    shift
fi
vertices=${1:-1000000}
out=${2:-out}

scripts/install_packages.sh demo
programs=(pbm-{sample,build,validate,render})
simd=()
case " $(grep -m1 '^flags' /proc/cpuinfo) " in
*" avx512vl "*) simd=(-DPBM_SIMD_TARGETS=HWY_AVX3) ;;
*" avx2 "*) simd=(-DPBM_SIMD_TARGETS=HWY_AVX2) ;;
esac
# What scripts/test.sh has configured stays as it is.
[ -f build/release/CMakeCache.txt ] || cmake --preset release "${simd[@]}" -DPBM_BUILD_TESTS=OFF \
    -DPBM_BUILD_VIEWER=OFF -DCMAKE_PREFIX_PATH="$PWD/build/packages/usr" >/dev/null
if [ -n "$viewer" ]; then
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
"$bin/pbm-build" "$scan" -o "$model"
"$bin/pbm-validate" "$model"
start=$EPOCHREALTIME
"$bin/pbm-render" "$model" -o "$picture" --resolution 1280,720 --quality fast
end=$EPOCHREALTIME
printf '\n%s: %d ms from the start of pbm-render to the PNG\n' "$picture" $(((${end/[.,]/} - ${start/[.,]/}) / 1000))
if [ -n "$viewer" ]; then
    echo "to look at it from all sides: $bin/pbm-view $model"
else
    echo "there is no display, so pbm-view was not built: scripts/demo.sh --viewer builds it"
fi
