#!/usr/bin/env bash
# Builds pbm-render and pbm-validate without any library (preset `static`) and runs them in an empty chroot:
# try_static.sh [--built]
#   --built  takes the programs of build/static/bin as they are
# Root only. Needs the set `packaging` of install_packages.sh. Ends with 77 where something is missing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
[ "$(id -u)" -eq 0 ] || { echo "skipped: not root" && exit 77; }
bin=build/static/bin
if [ "${1:-}" != --built ]; then
    command -v nasm >/dev/null || { echo "skipped: nasm is not installed" && exit 77; }
    scripts/static_libraries.sh
    cmake --preset static >/dev/null
    cmake --build --preset static --target pbm-render pbm-validate
fi

root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
cp $bin/pbm-render $bin/pbm-validate format_spec/vectors/valid/fields.pbvg "$root"
head -c 1000 "$root/fields.pbvg" >"$root/cut.pbvg"
chroot "$root" /pbm-validate fields.pbvg
chroot "$root" /pbm-render -q fields.pbvg -o fields.png
chroot "$root" /pbm-render -q --thumbnail 128 fields.pbvg -o fields.thumbnail
code=0
chroot "$root" /pbm-validate cut.pbvg || code=$?
[ $code -eq 3 ] || { echo "FAILED: a cut file ends with $code" >&2 && exit 1; }
for picture in fields.png fields.thumbnail; do
    [ "$(head -c 4 "$root/$picture" | tail -c 3)" = PNG ] || { echo "FAILED: $picture is no PNG" >&2 && exit 1; }
done
if [ -x build/release/bin/pbm-render ]; then # the same pixels, the same encoder
    build/release/bin/pbm-render -q format_spec/vectors/valid/fields.pbvg -o "$root/shared.png"
    cmp "$root/shared.png" "$root/fields.png"
fi
for program in pbm-render pbm-validate; do
    [ "$(find "$root/$program" -size -6000k)" ] || { echo "FAILED: $program is larger than 6 MB" >&2 && exit 1; }
    fastest=$(for _ in $(seq 50); do
        from=$(date +%s%N)
        chroot "$root" /$program --version >/dev/null
        echo $(($(date +%s%N) - from))
    done | sort -n | head -n 1)
    empty=$(for _ in $(seq 50); do
        from=$(date +%s%N)
        chroot "$root" /none >/dev/null 2>&1 || true
        echo $(($(date +%s%N) - from))
    done | sort -n | head -n 1)
    echo "$program: $(stat -c %s "$root/$program") bytes, start to end $(((fastest - empty) / 1000)) us"
done
