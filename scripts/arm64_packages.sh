#!/usr/bin/env bash
# Unpacks the arm64 packages that the preset `arm64` needs into build/arm64_packages/root. Nothing of them is installed:
# some of these packages replace their amd64 versions. apt works with lists and a cache of its own, so that it needs no
# root, changes nothing outside of this folder, and the machine knows no second architecture.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
made=$PWD/build/arm64_packages
part=$made.part
packages=(libc6-dev libhwy-dev libzstd-dev libxxhash-dev nlohmann-json3-dev libglm-dev libcli11-dev libisal-dev
    libjpeg62-turbo-dev libtomlplusplus-dev libpng-dev libstb-dev zlib1g-dev libwebp-dev libtiff-dev libsquish-dev
    libdraco-dev libmeshoptimizer-dev libexpat1-dev libeigen3-dev libgtest-dev)
alone=(libopenmesh-dev libopenmesh1) # without the 53 packages that they name: none is needed
wanted=$(printf '%s\n' "${packages[@]}" "${alone[@]}")
[ "$(cat "$made/names" 2>/dev/null)" != "$wanted" ] || exit 0 # all of them are there

rm -rf "$part"
mkdir -p "$part"/{sources,state/lists/partial,cache/archives/partial,root/usr/lib,dpkg/info,dpkg/updates}
for file in /etc/apt/sources.list /etc/apt/sources.list.d/debian.sources; do
    [ ! -f "$file" ] || cp "$file" "$part/sources"
done
touch "$part/sources/sources.list" "$part/state/status"
options=(-qq -o APT::Architecture=arm64 -o APT::Architectures=arm64 -o "APT::Sandbox::User="
    -o "Dir::Etc::SourceList=$part/sources/sources.list" -o "Dir::Etc::SourceParts=$part/sources"
    -o "Dir::State=$part/state" -o "Dir::State::status=$part/state/status" -o "Dir::Cache=$part/cache")
apt-get "${options[@]}" update
apt-get "${options[@]}" install --download-only --yes --no-install-recommends "${packages[@]}"
(cd "$part/cache/archives" && apt-get "${options[@]}" download "${alone[@]}")

# The list of a package's files and what its libraries are called for dpkg-shlibdeps, which names the dependencies of our
# own packages: a small database, as if all were installed in this folder.
ln -s usr/lib "$part/root/lib" # as on every Debian today
echo 1 >"$part/dpkg/info/format" # names of files may have an architecture
for file in "$part"/cache/archives/*.deb; do
    dpkg-deb --fsys-tarfile "$file" | tar -C "$part/root" -x --keep-directory-symlink
    name=$(dpkg-deb -f "$file" Package)
    [ "$(dpkg-deb -f "$file" Multi-Arch)" != same ] || name+=:arm64
    dpkg-deb -e "$file" "$part/control"
    for kind in symbols shlibs; do
        [ ! -f "$part/control/$kind" ] || mv "$part/control/$kind" "$part/dpkg/info/$name.$kind"
    done
    rm -r "$part/control"
    dpkg-deb --fsys-tarfile "$file" | tar -t | sed -n "s|^\./|/|; s|^/lib/|/usr/lib/|; s|[^/]\$|&|p" |
        sed "s|^|$made/root|" >"$part/dpkg/info/$name.list"
    { dpkg-deb -f "$file" Package Version Architecture Multi-Arch Maintainer Description && echo "Status: install ok installed" && echo; } \
        >>"$part/dpkg/status"
done
find "$part/root" -type l -lname '/*' | while read -r link; do # as links within this folder
    ln -snfr "$part/root$(readlink "$link")" "$link"
done
# The one CMake package that names its files by /usr instead of by its own place.
sed -i "s|\"/usr/lib/|\"$made/root/usr/lib/|g" "$part"/root/usr/lib/*/cmake/draco/draco-targets-none.cmake
rm -r "$part/cache" "$part/state" "$part/sources"
echo "$wanted" >"$part/names"
rm -rf "$made"
mv "$part" "$made"
du -sm "$made" | sed 's|\t.*/build| MB in build|'
