#!/usr/bin/env bash
# All campaigns in full: long.sh BUILD_FOLDER. Prints the table of docs/explanation/reliability.md; takes an hour or less.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?name the build folder}" && pwd)
shim=$build/tests/faults/libfault_shim.so
verdict=0
echo '| campaign | cases | not as if nothing were | laws broken | notes |'
echo '|---|---:|---:|---:|---|'
"$build/bin/faults" --long || verdict=1
if [ -f "$shim" ]; then # not with sanitizers
    python3 -B "$here/programs.py" "$build/bin" "$shim" "$build/tests/faults/long" --long || verdict=1
fi
exit "$verdict"
