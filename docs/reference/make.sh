#!/bin/sh
# Writes the pages of options, the `--help all` of each program: make.sh BIN [--check]
# BIN: the folder of the programs. --check: writes nothing, and fails where a page is not what its program says.
set -eu
cd "$(dirname "$0")"
for program in pbm-build pbm-render pbm-view pbm-validate pbm-info pbm-export pbm-sample; do
    page=$(
        printf '# %s\n\n<!-- Written by make.sh. -->\n\n```text\n' "$program"
        "$1/$program" --help all
        printf '```\n'
    )
    if [ "${2:-}" = --check ]; then
        printf '%s\n' "$page" | diff "$program.md" - || { echo "$program.md: run docs/reference/make.sh" && exit 1; }
    else
        printf '%s\n' "$page" >"$program.md"
    fi
done
