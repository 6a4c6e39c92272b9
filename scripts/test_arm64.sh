#!/usr/bin/env bash
# Builds everything but the window for 64-bit ARM with a cross compiler and tests it in qemu, on an x86-64 machine:
# test_arm64.sh [SCANS [STEP...]]
#   SCANS  a folder of real scans; default or empty: PBM_SCANS_DIR, or what tests/scan_folder.py finds
# Steps; without one, all of them, one after the other:
#   build     unpacks arm64 packages, builds native programs to compare with, and all programs and tests for ARM
#   units     unit tests
#   compare   verdicts, models and pictures are those of x86-64, to the byte and the pixel
#   packages  Debian packages in build/arm64/packages and the Python wheel in build/arm64/wheel
# Needs apt's archives for arm64, and installs nothing of that machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
scans=${1:-${PBM_SCANS_DIR:-}}
shift || true
[ $# -gt 0 ] || set -- build units compare packages
root=$PWD/build/arm64_packages/root
bin=build/arm64/bin
emulator=(qemu-aarch64 -L "$root")

step() { printf '\n== %s (%d s so far)\n' "$1" "$SECONDS"; }

tests=({scan,build,export,bindings,render,format,bake,command_line,sample}_tests)
failed=()

build() {
    step packages
    scripts/install_packages.sh arm64
    scripts/arm64_packages.sh

    step "native programs, to compare with"
    cmake --preset release >/dev/null
    cmake --build --preset release --target pbm-{build,render,validate}

    step "64-bit ARM"
    cmake --preset arm64 >/dev/null
    cmake --build --preset arm64 --target man {system,format_spec,command_line,runtime,tools,data,bindings}/all "${tests[@]}"
}

units() {
    step "unit tests"
    local left_out=ChildProcess.AllocatingWithoutBoundEndsAtTheLimit # qemu does not limit the memory of a process
    local shards=8 # of each program: the processors end at about the same time
    for test in "${tests[@]}"; do
        for ((shard = 0; shard < shards; ++shard)); do
            echo "$test GTEST_TOTAL_SHARDS=$shards GTEST_SHARD_INDEX=$shard ${emulator[*]} $bin/$test"
        done
    done | LD_LIBRARY_PATH=build/arm64/bindings/c xargs -P "$(nproc)" -I{} bash -c '
        read -r test command <<<"{}"
        env $command --gtest_brief=1 --gtest_filter=-'$left_out' || { echo "FAILED: $test"; exit 1; }' ||
        failed+=("unit tests")
}

compare() {
    step "files and pictures of both machines"
    python3 -B tests/portable/compare_machines.py build/release/bin $bin . build/arm64/compared \
        ${scans:+--scans "$scans"} -- "${emulator[@]}" || failed+=("files and pictures")
}

packages() {
    step "Debian packages and wheel"
    packages=build/arm64/packages
    rm -rf $packages build/arm64/wheel
    # dpkg-shlibdeps looks libraries up among the unpacked packages.
    shim=$(mktemp -d)
    trap 'rm -rf "$shim"' EXIT
    cat >"$shim/dpkg-shlibdeps" <<END
#!/bin/sh
exec env DEB_HOST_ARCH=arm64 $(command -v dpkg-shlibdeps) --admindir=$PWD/build/arm64_packages/dpkg \
    -l$root/usr/lib/aarch64-linux-gnu "\$@"
END
    chmod +x "$shim/dpkg-shlibdeps"
    PATH=$shim:$PATH cpack --config build/arm64/CPackConfig.cmake -B $packages >/dev/null
    for package in $packages/*.deb; do
        printf '%s: %s\n' "$package" "$(dpkg-deb -f "$package" Depends)"
    done
    MACHINE=aarch64 SYSROOT=$root LIST_LIBRARIES="${emulator[*]} $root/lib/ld-linux-aarch64.so.1 --list" \
        scripts/make_wheel.sh build/arm64 build/arm64/wheel
}

for part in "$@"; do
    case $part in
    build | units | compare | packages) "$part" ;;
    *)
        echo "test_arm64.sh: no step is called $part" >&2
        exit 2
        ;;
    esac
done

step end
if [ ${#failed[@]} -ne 0 ]; then
    printf 'FAILED: %s\n' "${failed[@]}"
    exit 1
fi
echo "all passed"
