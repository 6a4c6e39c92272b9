#!/usr/bin/env bash
# Formatting and static analysis of our own sources: lint.sh [BUILD_FOLDER [FILE...]]. No warning is tolerated.
# Files whose text and flags passed before are skipped; stamps lie in BUILD_FOLDER/lint.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=${1:-build/release}
shift || true

[ -f "$build/compile_commands.json" ] || cmake --preset release -B "$build" >/dev/null
folders=(format_spec command_line runtime tools data tests bench examples)
mapfile -t all < <(find "${folders[@]}" \( -name '*.h' -o -name '*.cpp' \) -type f | sort)
verdict=0
unformatted=$(clang-format --dry-run "${all[@]}" 2>&1 | sed -n 's/^\([^ :]*\):[0-9:]* warning: code should.*/\1/p' | sort -u)
if [ -n "$unformatted" ]; then
    echo "to be formatted with clang-format -i:" $unformatted >&2
    verdict=1
fi
echo "clang-format: ${#all[@]} files"

export build
stamps=$build/lint
export stamps
mkdir -p "$stamps"
# A stamp remembers everything that can change the verdict of a file: all headers, the configuration, the file itself.
headers=$(find "${folders[@]}" -name '*.h' -type f -print0 | sort -z | xargs -0 cat .clang-tidy | sha256sum)
export headers

tidy() {
    local file=$1 stamp
    stamp=$stamps/${file//\//_}
    local sum
    sum=$({ echo "$headers"; cat "$file"; } | sha256sum)
    [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$sum" ] && return 0
    rm -f "$stamp"
    clang-tidy --quiet -p "$build" "$file" 2> >(grep -vE '^[0-9]+ warnings?( and [0-9]+ errors?)? generated\.$' >&2) || return 1
    echo "$sum" >"$stamp"
}
export -f tidy

if [ $# -gt 0 ]; then
    sources=("$@")
else
    mapfile -t sources < <(python3 - "$build/compile_commands.json" <<'PY'
import json, os, sys
files = {os.path.relpath(os.path.realpath(entry["file"])) for entry in json.load(open(sys.argv[1]))}
print("\n".join(sorted(file for file in files if not file.startswith(("..", "build")))))
PY
    )
fi
printf '%s\0' "${sources[@]}" | xargs -0 -P 2 -n 1 bash -c 'tidy "$1"' tidy || verdict=1
echo "clang-tidy: ${#sources[@]} files"
exit "$verdict"
