#!/usr/bin/env bash
# Builds everything but the window for 64-bit ARM with a cross compiler and tests it in qemu, on an x86-64 machine:
# test_arm64.sh [SCANS]
#   SCANS  a folder of real scans; default: PBM_SCANS_DIR, or what tests/scan_folder.py finds
# Unit tests pass; verdicts, models and pictures are those of x86-64, to the byte and the pixel; ends with Debian packages
# in build/arm64/packages and the Python wheel in build/arm64/wheel. Needs apt's archives for arm64, and installs nothing
# of that machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
scans=${1:-${PBM_SCANS_DIR:-}}
root=$PWD/build/arm64_packages/root
bin=build/arm64/bin
emulator=(qemu-aarch64 -L "$root")

step() { printf '\n== %s (%d s so far)\n' "$1" "$SECONDS"; }

step packages
scripts/install_packages.sh arm64
scripts/arm64_packages.sh

step "native programs, to compare with"
cmake --preset release >/dev/null
cmake --build --preset release --target pbm-{build,render,validate}

step "64-bit ARM"
cmake --preset arm64 >/dev/null
tests=({command_line,format,bake,render,scan,build,export,bindings,sample}_tests)
cmake --build --preset arm64 --target man {system,format_spec,command_line,runtime,tools,data,bindings}/all "${tests[@]}"

failed=()
step "unit tests"
left_out=ChildProcess.AllocatingWithoutBoundEndsAtTheLimit # qemu does not limit the memory of a process
for test in "${tests[@]}"; do
    pids=()
    for ((shard = 0; shard < $(nproc); ++shard)); do
        GTEST_TOTAL_SHARDS=$(nproc) GTEST_SHARD_INDEX=$shard LD_LIBRARY_PATH=build/arm64/bindings/c \
            "${emulator[@]}" "$bin/$test" --gtest_brief=1 --gtest_filter="-$left_out" &
        pids+=($!)
    done
    for pid in "${pids[@]}"; do
        wait "$pid" || failed+=("$test")
    done
done

step "files and pictures of both machines"
python3 -B tests/portable/compare_machines.py build/release/bin $bin . build/arm64/compared ${scans:+--scans "$scans"} \
    -- "${emulator[@]}" || failed+=("files and pictures")

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

step end
if [ ${#failed[@]} -ne 0 ]; then
    printf 'FAILED: %s\n' "${failed[@]}"
    exit 1
fi
echo "all passed"
