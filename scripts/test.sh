#!/usr/bin/env bash
# Sets everything up and passes the tests: packages, lint, then builds and tests with and without sanitizers.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export CTEST_PARALLEL_LEVEL=${CTEST_PARALLEL_LEVEL:-2}

step() { printf '\n== %s (%d s so far)\n' "$1" "$SECONDS"; }

step packages
scripts/install_packages.sh all

failed=()
for preset in release asan; do
    step "$preset: build"
    cmake --preset "$preset" >/dev/null
    cmake --build --preset "$preset" -j 2
    step "$preset: test"
    ctest --preset "$preset" --output-on-failure -j "$CTEST_PARALLEL_LEVEL" || failed+=("tests of $preset")
done

step "runtime-only: build"
cmake --preset runtime-only >/dev/null
cmake --build --preset runtime-only -j 2 || failed+=("build of runtime-only")

step lint
scripts/lint.sh build/release || failed+=(lint)

step done
if [ ${#failed[@]} -ne 0 ]; then
    printf 'FAILED: %s\n' "${failed[@]}"
    exit 1
fi
echo "all passed"
