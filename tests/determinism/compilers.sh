#!/usr/bin/env bash
# g++ and clang++ build the same models: compilers.sh FOLDER [SCAN...]
# Builds pbm-build with both in FOLDER, runs the long form of same_bytes.py with each, and compares the models' hashes.
# Environment: COMPILERS (other compilers, must include g++), JOBS (for ninja), CMAKE_CXX_COMPILER_LAUNCHER (see CMake).
set -euo pipefail

source=$(cd "$(dirname "$0")/../.." && pwd)
folder=$(mkdir -p "$1" && cd "$1" && pwd)
shift
scans=()
for scan in "$@"; do
    scans+=("$(realpath "$scan")")
done

for compiler in ${COMPILERS:-g++ clang++}; do
    build=$folder/$compiler
    cmake -S "$source" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER="$compiler" \
        ${CMAKE_CXX_COMPILER_LAUNCHER:+-DCMAKE_CXX_COMPILER_LAUNCHER=$CMAKE_CXX_COMPILER_LAUNCHER} >"$build.log"
    ninja -C "$build" ${JOBS:+-j$JOBS} pbm-build pbm-sample build_with_target >>"$build.log"
    echo "== $compiler"
    python3 -B "$source/tests/determinism/same_bytes.py" "$build"/bin/{pbm-build,build_with_target,pbm-sample} \
        "$folder/work" --hashes "$folder/$compiler.sha256" --vertices 100000 --long "${scans[@]}"
done
status=0
for other in "$folder"/*.sha256; do
    if cmp "$folder/g++.sha256" "$other"; then
        echo "same bytes: g++, $(basename "$other" .sha256)"
    else
        status=1
    fi
done
exit $status
