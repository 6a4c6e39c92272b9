#!/usr/bin/env bash
# Sets everything up and passes the tests: packages, lint, then builds and tests with and without sanitizers.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export CTEST_PARALLEL_LEVEL=${CTEST_PARALLEL_LEVEL:-2}

step() { printf '\n== %s (%d s so far)\n' "$1" "$SECONDS"; }

step packages
scripts/install_packages.sh all

# The build of the run time alone compiles what release has compiled: it takes the same objects.
export CCACHE_DIR=$PWD/build/ccache CCACHE_BASEDIR=$PWD
# All that is tested, and what is installed. Programs of bench/ are measured by people; lint sees that they compile.
targets=(man {system,format_spec,command_line,runtime,tools,data,tests}/all)

failed=()
for preset in release asan; do
    step "$preset: build"
    launcher=()
    [ "$preset" = release ] && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
    cmake --preset "$preset" "${launcher[@]}" >/dev/null
    cmake --build --preset "$preset" -j 2 --target "${targets[@]}"
    step "$preset: test"
    ctest --preset "$preset" --output-on-failure -j "$CTEST_PARALLEL_LEVEL" || failed+=("tests of $preset")
done

step "runtime-only: build"
cmake --preset runtime-only -DCMAKE_CXX_COMPILER_LAUNCHER=ccache >/dev/null
cmake --build --preset runtime-only -j 2 || failed+=("build of runtime-only")

step lint
scripts/lint.sh build/release || failed+=(lint)

step done
if [ ${#failed[@]} -ne 0 ]; then
    printf 'FAILED: %s\n' "${failed[@]}"
    exit 1
fi
echo "all passed"
