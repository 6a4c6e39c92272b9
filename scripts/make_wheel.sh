#!/usr/bin/env bash
# Makes the Python wheel: make_wheel.sh [BUILD_FOLDER [OUTPUT_FOLDER]], by default build/release and build/wheel.
# A build for another machine (scripts/test_arm64.sh) needs three variables: MACHINE, as `uname -m` says it there; SYSROOT,
# the folder of its libraries; LIST_LIBRARIES, a command that prints what ldd would print there.
# The wheel holds libpbm, the programs, and every library that they need and that a system with glibc and the C++ run
# time may lack. It needs no network, and of $PYTHON (by default Debian's) the packages build, setuptools and wheel.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=$(realpath -m "${1:-build/release}")
output=$(realpath -m "${2:-build/wheel}")
python=${PYTHON:-/usr/bin/python3}
machine=${MACHINE:-$(uname -m)}
tools= # prefix of binutils' programs
[ "$machine" = "$(uname -m)" ] || tools=$machine-linux-gnu-
read -ra ldd <<<"${LIST_LIBRARIES:-ldd}"

for file in "$build/bindings/c/libpbm.so.1" "$build/bin/pbm-build"; do
    [ -e "$file" ] || {
        echo "make_wheel: $file is not built: cmake --build $build" >&2
        exit 1
    }
done
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
cp -r bindings/python/. LICENSE "$stage"
rm -rf "$stage"/pbm/__pycache__
libs=$stage/pbm/libs programs=$stage/pbm/bin
mkdir -p "$libs" "$programs"
cp -L "$build/bindings/c/libpbm.so.1" "$libs"
for program in build render validate info export; do
    cp "$build/bin/pbm-$program" "$programs"
done
"${tools}strip" "$programs"/*

# ldd names libraries of libraries too.
system='^(.*/)?(linux-vdso|ld-linux.*|libc|libm|libdl|librt|libpthread|libstdc\+\+|libgcc_s)\.so'
for file in "$libs"/* "$programs"/*; do
    "${ldd[@]}" "$file"
done | awk '$2 == "=>" { print $1, $3 }' | sort -u | while read -r name path; do
    [[ $name =~ $system ]] && continue
    [ "$path" != not ] || {
        echo "make_wheel: $name is not found" >&2
        exit 1
    }
    cp -L "${SYSROOT:-}$path" "$libs/$name"
done
for file in "$libs"/*; do
    patchelf --set-rpath "\$ORIGIN" "$file"
done
for file in "$programs"/*; do
    patchelf --set-rpath "\$ORIGIN/../libs" "$file"
done

# The oldest glibc with all symbols that these files use decides on which systems pip installs the wheel.
minor=$("${tools}objdump" -T "$libs"/* "$programs"/* | grep -o 'GLIBC_2\.[0-9]*' | cut -d. -f2 | sort -n | tail -1)
PBM_WHEEL_VERSION=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
PBM_WHEEL_PLATFORM=manylinux_2_${minor}_$machine
export PBM_WHEEL_VERSION PBM_WHEEL_PLATFORM
mkdir -p "$output"
cd "$stage" # where no folder is called build
"$python" -m build --wheel --no-isolation --outdir "$output" . >log 2>&1 || {
    cat log >&2
    exit 1
}
wheel=$output/pbm_scan-$PBM_WHEEL_VERSION-py3-none-$PBM_WHEEL_PLATFORM.whl
echo "$wheel: $(stat -c %s "$wheel") bytes"
