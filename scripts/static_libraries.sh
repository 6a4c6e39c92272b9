#!/usr/bin/env bash
# Makes what the preset `static` needs and Debian has as a shared library only: build/static_libraries/libisal.a, from
# Debian's source package. Needs dpkg-dev, make, nasm, and apt with the same archives as for binary packages.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
made=$PWD/build/static_libraries
[ ! -f "$made/libisal.a" ] || exit 0

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
chmod 755 "$work" # apt fetches as a user of its own
mkdir -p "$work"/{archives,lists/partial} "$made"
for file in /etc/apt/sources.list /etc/apt/sources.list.d/debian.sources; do
    [ ! -f "$file" ] || sed 's/^Types: deb$/Types: deb-src/; s/^deb /deb-src /' "$file" >"$work/archives/${file##*/}"
done
touch "$work/archives/sources.list"
options=(-qq -o "Dir::Etc::SourceList=$work/archives/sources.list" -o "Dir::Etc::SourceParts=$work/archives"
    -o "Dir::State::Lists=$work/lists")
apt-get "${options[@]}" update
cd "$work"
apt-get "${options[@]}" source --download-only libisal 2>&1 | sed '/unsandboxed/d' >&2
dpkg-source --no-check -x libisal_*.dsc isal >/dev/null
make -s -C isal -f Makefile.unx -j "$(nproc)" units="igzip crc" lib >"$work/log" 2>&1 ||
    { cat "$work/log" >&2 && exit 1; }
mv isal/bin/isa-l.a "$made/libisal.a"
echo "$made/libisal.a"
