#!/usr/bin/env bash
# Tries the Debian packages as a new user would: builds them, asks lintian, installs them with apt into a clean Debian
# 12, runs the programs on a sample, purges them, and looks for what is left. try_packages.sh [--built] [FOLDER]
#   --built  takes the packages of build/package/packages as they are
#   FOLDER   where the Debian is made; default: a temporary folder, removed in the end
# Root only. Needs the sets `packaging` and `site` of install_packages.sh and the network of apt. Ends with 77 where one is
# missing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
built=false
[ "${1:-}" != --built ] || { built=true && shift; }
for program in mmdebstrap lintian dpkg-shlibdeps; do
    command -v "$program" >/dev/null || { echo "skipped: $program is not installed" && exit 77; }
done
[ "$(id -u)" -eq 0 ] || { echo "skipped: not root" && exit 77; }

packages=build/package/packages
if ! $built; then
    cmake --preset package >/dev/null
    cmake --build --preset package --target all site
    rm -rf $packages
    cpack --config build/package/CPackConfig.cmake -B $packages >/dev/null
fi
ls -l $packages/*.deb | awk '{ print $5, $9 }'
lintian --fail-on error --suppress-tags bad-distribution-in-changes-file $packages/*.deb
echo "lintian: no errors"

root=${1:-$(mktemp -d)}
clean() {
    ! mountpoint -q "$root/proc" || umount "$root/proc"
    [ "${1:-}" = keep ] || rm -rf "$root"
}
[ $# -eq 0 ] && trap clean EXIT || trap 'clean keep' EXIT
[ -d "$root/etc" ] || mmdebstrap --quiet --variant=apt bookworm "$root"
mount -t proc proc "$root/proc"
inside() {
    chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 HOME=/root "$@"
}
# Runs a command in the chroot; what it says is printed only if it fails.
quietly() {
    inside sh -ec "$1" >"$root/root/log" 2>&1 || { cat "$root/root/log" >&2 && exit 1; }
}
# Every file but those in which apt, dpkg and ldconfig keep their own state.
list() {
    (cd "$root" && find . -xdev) |
        grep -Ev '^\./(proc|root|run|tmp|var/log|var/cache|var/tmp|var/lib/apt|var/lib/dpkg)(/|$)|^\./etc/ld.so.cache$' | sort
    (cd "$root/var/lib/dpkg" && find info alternatives -type f) | sort
}
inside apt-get -qq update
inside apt-get -qq autoremove --purge --yes >/dev/null
list >"$root/root/before"
grown() { du -sm --exclude=proc --exclude=apt --exclude=packages "$root" | cut -f1; }
before=$(grown)

mkdir -p "$root/root/packages"
cp $packages/*.deb "$root/root/packages/"
quietly 'apt-get -qq install --yes --no-install-recommends /root/packages/pbm-tools_*.deb'
inside apt-get clean
echo "pbm-tools with what it needs: $(($(grown) - before)) MB above the clean Debian"
inside sh -ec '
    cd /root
    pbm-sample -q --vertices 20000 -o sample.ply
    pbm-build -q sample.ply -o sample.pbvg
    pbm-validate sample.pbvg
    pbm-render -q sample.pbvg -o sample.png
    pbm-render -q --thumbnail 256 sample.pbvg -o sample.thumbnail
    pbm-info sample.pbvg >sample.txt
    pbm-export -q sample.pbvg -o points.ply
    test -s sample.png -a -s sample.thumbnail -a -s sample.txt -a -s points.ply'
milliseconds() { # of the fastest of ten runs
    for _ in 1 2 3 4 5 6 7 8 9 10; do
        local from
        from=$(date +%s%N)
        "$@" >/dev/null
        echo $((($(date +%s%N) - from) / 100000))
    done | sort -n | sed -n '1s/\(.\)$/.\1/p'
}
echo "from chroot to PNG: $(milliseconds inside pbm-render -q /root/sample.pbvg -o /root/sample.png) ms," \
    "of which an empty program takes $(milliseconds inside true)"

quietly 'apt-get -qq install --yes --no-install-recommends /root/packages/*.deb'
inside pbm-view --version
test -s "$root/usr/share/man/man1/pbm-view.1.gz" -a -s "$root/usr/share/applications/pbm-view.desktop"
quietly 'cd /root && python3 -c "import pbm
model = pbm.open(\"sample.pbvg\")
assert len(model.points(level=3)[\"positions\"]) > 100 and pbm.validate(\"sample.pbvg\").valid"'
echo "points read with python3-pbm"
test -s "$root/usr/share/doc/pbm/html/index.html"
quietly 'apt-get -qq install --yes --no-install-recommends g++ cmake make pkg-config
    cp -r /usr/share/doc/pbm/examples /root/examples
    cmake -S /root/examples -B /root/examples/build
    cmake --build /root/examples/build
    /root/examples/build/read_points /root/sample.pbvg 3
    make -C /root/examples/c
    /root/examples/c/draw_model /root/sample.pbvg /root/sample.ppm'
echo "examples built with libpbm-dev"
names=$(inside sh -c 'dpkg-query -W -f="\${Package}\n" "*pbm*"')
quietly "apt-get -qq purge --yes $(echo $names) g++ cmake make pkg-config && apt-get -qq autoremove --purge --yes"
list >"$root/root/after"
if ! diff "$root/root/before" "$root/root/after"; then
    echo "FAILED: files are left" >&2
    exit 1
fi
echo "installed and purged:" $names
