#!/usr/bin/env bash
# Formatting and static analysis of our own sources: lint.sh [BUILD_FOLDER [FILE...]]. No warning is tolerated.
# Files whose text and flags passed before are skipped; stamps lie in BUILD_FOLDER/tidy.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=${1:-build/release}
shift || true

[ -f "$build/compile_commands.json" ] || cmake --preset release -B "$build" >/dev/null
folders=(system format_spec command_line runtime tools data bindings tests bench examples)
mapfile -t all < <(find "${folders[@]}" -name node_modules -prune -o \( -name "*.h" -o -name "*.cpp" \) -type f -print | sort)
verdict=0
unformatted=$(clang-format --dry-run "${all[@]}" 2>&1 | sed -n 's/^\([^ :]*\):[0-9:]* warning: code should.*/\1/p' | sort -u)
if [ -n "$unformatted" ]; then
    echo "to be formatted with clang-format -i:" $unformatted >&2
    verdict=1
fi
echo "clang-format: ${#all[@]} files"

python3 -B scripts/tidy.py "$build" "$@" || verdict=1
exit "$verdict"
