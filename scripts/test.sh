#!/usr/bin/env bash
# Sets everything up and passes the tests: test.sh [STEP...]. Steps, one after the other; without one, the first:
#   release    build and tests, but for `subproject`
#   subproject a build as a part of another project with another compiler; needs what `release` configures
#   sanitized  tests of what reads foreign bytes and of the C API, with address and undefined-behaviour sanitizers
#   lint       formatting and static analysis; needs the files that `release` makes
# The longer forms of tests are left to `ctest --test-dir build/release -C nightly -L nightly`: tests/README.md.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
jobs=$(nproc)
[ $# -gt 0 ] || set -- release

minutes=()
step() {
    minutes+=("$SECONDS ${1:-}")
    [ $# -eq 0 ] || printf '\n== %s (%d s so far)\n' "$1" "$SECONDS"
}

failed=()
build_and_test() { # PRESET TARGETS CTEST_ARGUMENT...
    local preset=$1 targets=$2
    step "$preset: build"
    cmake --preset "$preset" >/dev/null
    cmake --build --preset "$preset" -j "$jobs" --target $targets
    step "$preset: test"
    # Two more than there are cores: the longest two tests wait for windows most of their time.
    ctest --preset "$preset" --output-on-failure -j "${CTEST_PARALLEL_LEVEL:-$((jobs + 2))}" "${@:3}" ||
        failed+=("tests of $preset")
}

step packages
scripts/install_packages.sh all

for part in "$@"; do
    case $part in
    release)
        # All that is tested, and what is installed. Programs of bench/ are measured by people; lint sees that they compile.
        build_and_test release "man $(printf '%s/all ' system format_spec command_line runtime tools data bindings tests)" \
            -E '^install\.subproject$'
        ;;
    subproject)
        step subproject
        ctest --preset release --output-on-failure -R '^install\.subproject$' || failed+=(subproject)
        ;;
    sanitized) build_and_test asan foreign -L foreign ;;
    lint)
        step lint
        scripts/lint.sh build/release || failed+=(lint)
        ;;
    *)
        echo "test.sh: no step is called $part" >&2
        exit 2
        ;;
    esac
done

step
printf '\n== minutes\n'
for ((i = 0; i + 1 < ${#minutes[@]}; ++i)); do
    from=${minutes[i]%% *} to=${minutes[i + 1]%% *}
    printf '%5.1f  %s\n' "$((10 * (to - from) / 60))e-1" "${minutes[i]#* }"
done
printf '%5.1f  all\n' "$((10 * SECONDS / 60))e-1"
if [ ${#failed[@]} -ne 0 ]; then
    printf 'FAILED: %s\n' "${failed[@]}"
    exit 1
fi
echo "all passed"
