#!/usr/bin/env bash
# Installs the Debian 12 packages PBM needs: install_packages.sh [SET]
#   runtime  to build the format library, the renderer and pbm-render: nothing that knows of displays
#   viewer   also pbm-view
#   demo     to build every program but pbm-view; scripts/demo.sh builds four of them
#   all      also pbm-view, the tests, the benches' peers, the linters and the fuzzers (default)
#   peers    also F3D and CGAL, which bench/run and bench/normals measure against: 500 MB
#   nightly  also a second clang, of which nightly tests ask what it warns of
#   packaging  also what scripts/try_packages.sh, try_static.sh and try_container.sh need
#   arm64    also what scripts/test_arm64.sh needs: the cross compiler, qemu. scripts/arm64_packages.sh has the libraries
#   web      for scripts/test_web.sh: emscripten, 800 MB, node, Chromium, and the source of zstd
#   site     for scripts/make_site.sh alone, and Chromium, in which its nightly test opens the site
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

runtime=(g++ cmake ninja-build pkg-config
    libhwy-dev libzstd-dev libxxhash-dev nlohmann-json3-dev libglm-dev libcli11-dev libisal-dev
    libjpeg62-turbo-dev libstb-dev)
viewer=("${runtime[@]}" libglfw3-dev libepoxy-dev libimgui-dev)
demo=("${runtime[@]}" libtomlplusplus-dev libpng-dev zlib1g-dev libwebp-dev libtiff-dev libsquish-dev
    libdraco-dev libmeshoptimizer-dev libexpat1-dev libeigen3-dev)
all=("${viewer[@]}" "${demo[@]}" libopenmesh-dev libopenexr-dev openexr openimageio-tools
    ccache libgtest-dev libembree-dev python3 python3-jsonschema python3-zstandard python3-xxhash python3-yaml
    git meson pre-commit bazel-bootstrap
    valgrind zstd make mandoc groff-base draco
    xvfb xdotool imagemagick ffmpeg libgl1-mesa-dri
    abigail-tools python3-numpy mypy python3-build python3-venv python3-setuptools python3-wheel patchelf
    desktop-file-utils appstream shared-mime-info xdg-utils libglib2.0-bin zsh fish
    clang clang-14 libclang-rt-14-dev clang-tidy clang-format)
peers=("${all[@]}" f3d libcgal-dev)
[ "$(dpkg --print-architecture)" != amd64 ] || all+=(lib32stdc++-12-dev libc6-dev-i386) # builds for 32 bits
nightly=("${all[@]}" clang-16)
arm64=("${all[@]}" g++-aarch64-linux-gnu qemu-user dpkg-dev file)
packaging=("${all[@]}" mmdebstrap lintian dpkg-dev file nasm buildah)
site=(mkdocs mkdocs-material python3-pil chromium)
web=("${runtime[@]}" emscripten esbuild chromium xz-utils)
for program in node:nodejs npm:npm; do # another node than Debian's may be there, which brings npm
    command -v "${program%:*}" >/dev/null || web+=("${program#*:}")
done

case ${1:-all} in
runtime | viewer | demo | all | peers | nightly | packaging | arm64 | site | web) declare -n packages=${1:-all} ;;
*)
    echo "usage: install_packages.sh [runtime|viewer|demo|all|peers|nightly|packaging|arm64|site|web]" >&2
    exit 1
    ;;
esac

installed=$(dpkg-query -W -f='${db:Status-Status} ${Package}\n' "${packages[@]}" 2>/dev/null |
    sed -n 's/^installed //p') || true
mapfile -t missing < <(printf '%s\n' "${packages[@]}" | sort -u | grep -vxF -e "$installed")
if [ ${#missing[@]} -ne 0 ]; then
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
fi

# libopenmesh-dev depends on 53 packages with 166 MB, of which neither OpenMesh's headers nor its library need any. The
# set `demo` takes these two out of their packages; CMake looks for them in this folder too.
unpacked=build/packages
if [ "${1:-all}" = demo ] && [ ! -d $unpacked ] && ! dpkg-query -W libopenmesh-dev >/dev/null 2>&1; then
    echo "packages: unpacking libopenmesh-dev and libopenmesh1 into $unpacked"
    mkdir -p $unpacked.part
    (cd $unpacked.part && apt-get -q download libopenmesh-dev libopenmesh1)
    for file in $unpacked.part/*.deb; do
        dpkg-deb -x "$file" $unpacked.part
    done
    mv $unpacked.part $unpacked
fi

# The schema of SARIF, which Debian does not have. Without npm, or without a network, its test uses a part of it alone.
sarif=build/sarif
if [ "${1:-all}" = all ] && [ ! -d $sarif ] && command -v npm >/dev/null; then
    mkdir -p $sarif.part
    if (cd $sarif.part && npm pack --silent @microsoft/jest-sarif@1.0.0-beta.0 >/dev/null && tar -xzf ./*.tgz); then
        mv $sarif.part $sarif
    else
        echo "packages: the schema of SARIF is not to be had" >&2
        rm -r $sarif.part
    fi
fi

# The decoder of zstd is compiled for WebAssembly from Debian's source package, of the version of libzstd-dev. The lists of
# packages that apt has name no sources: lists of its own do.
zstd=build/zstd
if [ "${1:-all}" = web ] && [ ! -d $zstd ]; then
    version=$(dpkg-query -W -f='${source:Version}' libzstd-dev)
    echo "packages: fetching the source of zstd $version into $zstd"
    rm -rf $zstd.part
    mkdir -p $zstd.part/{parts,lists,source}
    for list in /etc/apt/sources.list /etc/apt/sources.list.d/*; do
        [ ! -f "$list" ] ||
            sed -e 's/^deb /deb-src /' -e 's/^Types: deb$/Types: deb-src/' "$list" >"$zstd.part/parts/$(basename "$list")"
    done
    [ ! -f $zstd.part/parts/sources.list ] || mv $zstd.part/parts/sources.list $zstd.part/parts/main.list
    options=(-q -o Dir::Etc::sourcelist=/dev/null -o "Dir::Etc::sourceparts=$PWD/$zstd.part/parts"
        -o "Dir::State::lists=$PWD/$zstd.part/lists" -o APT::Sandbox::User=root)
    apt-get "${options[@]}" update || true # lists of other origin have no sources
    # A security update may leave its pool before it leaves the lists; the release has the same upstream source.
    (cd $zstd.part && { apt-get "${options[@]}" source --download-only "libzstd=$version" ||
        apt-get "${options[@]}" source --download-only "libzstd=${version%+deb*}"; })
    tar -xf $zstd.part/libzstd_*.orig.tar.xz -C $zstd.part/source --strip-components=1
    mv $zstd.part/source $zstd
    rm -r $zstd.part
fi
