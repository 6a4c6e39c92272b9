#!/usr/bin/env bash
# Installs the Debian 12 packages PBM needs: install_packages.sh [runtime|viewer|all|peers]
#   runtime  to build the format library, the renderer and pbm-render: nothing that knows of displays
#   viewer   also pbm-view
#   all      also pbm-build, the sample generator, the tests, the benches' peers, the linters and the fuzzers (default)
#   peers    also F3D, which bench/run measures against: 300 MB
set -euo pipefail

build_system=(g++ cmake ninja-build pkg-config)
runtime=(libhwy-dev libzstd-dev libxxhash-dev nlohmann-json3-dev libglm-dev libcli11-dev libisal-dev
    libjpeg62-turbo-dev zlib1g-dev)
viewer=(libglfw3-dev libepoxy-dev libimgui-dev)
tools=(libopenmesh-dev libtomlplusplus-dev libjpeg62-turbo-dev libpng-dev libstb-dev)
tests=(ccache libgtest-dev libembree-dev libpng-dev python3 python3-jsonschema python3-zstandard python3-xxhash
    valgrind zstd make mandoc groff-base draco libdraco-dev lib32stdc++-12-dev libc6-dev-i386)
window_tests=(xvfb xdotool imagemagick libgl1-mesa-dri)
peers=(f3d)
clang=(clang libclang-rt-14-dev clang-tidy clang-format)

case ${1:-all} in
runtime) packages=("${build_system[@]}" "${runtime[@]}") ;;
viewer) packages=("${build_system[@]}" "${runtime[@]}" "${viewer[@]}") ;;
all)
    packages=("${build_system[@]}" "${runtime[@]}" "${viewer[@]}" "${tools[@]}" "${tests[@]}" "${window_tests[@]}"
        "${clang[@]}")
    ;;
peers)
    packages=("${build_system[@]}" "${runtime[@]}" "${viewer[@]}" "${tools[@]}" "${tests[@]}" "${window_tests[@]}"
        "${clang[@]}" "${peers[@]}")
    ;;
*)
    echo "usage: install_packages.sh [runtime|viewer|all|peers]" >&2
    exit 1
    ;;
esac

installed=$(dpkg-query -W -f='${db:Status-Status} ${Package}\n' "${packages[@]}" 2>/dev/null |
    sed -n 's/^installed //p') || true
missing=()
for package in "${packages[@]}"; do
    grep -qxF -- "$package" <<<"$installed" || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
    echo "packages: all ${#packages[@]} installed"
    exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || {
        echo "packages: run as root or install sudo; missing: ${missing[*]}" >&2
        exit 1
    }
    as_root=(sudo)
fi
echo "packages: installing ${missing[*]}"
options=(-q -o DPkg::Lock::Timeout=300)
"${as_root[@]}" apt-get "${options[@]}" update
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get "${options[@]}" install --yes --no-install-recommends "${missing[@]}"
