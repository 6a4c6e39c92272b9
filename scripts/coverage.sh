#!/usr/bin/env bash
# Which lines of the reading side of the format library do unit tests, vectors and fuzz corpora run?
#   scripts/coverage.sh [BUILD_FOLDER]
# Prints a table of files and, in BUILD_FOLDER/uncovered.txt, the lines that nothing ran; fails below 95 %.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=${1:-build/coverage}
least=95
targets=(reader validator chunk unfilter mask_ranks raster)
cmake --preset coverage -B "$build" >/dev/null
cmake --build "$build" --target format_tests "${targets[@]/%/_fuzz}"

# Everything that reads and checks files, but advice. (tests/faults has what the system refuses.)
mapfile -t sources < <(find format_spec/pbm_format -name '*.h' -o -name '*.cpp' | grep -vE '/(writing/|section_encoder\.|advice\.)')

rm -rf "$build/profiles"
mkdir "$build/profiles"
export LLVM_PROFILE_FILE=$PWD/$build/profiles/%p.profraw
"$build/bin/format_tests" --gtest_brief=1 --gtest_filter=-ChildProcess.*
corpus=tests/fuzz/corpus
"$build/bin/chunk_fuzz" $corpus/chunk 2>/dev/null
"$build/bin/unfilter_fuzz" $corpus/unfilter 2>/dev/null
"$build/bin/mask_ranks_fuzz" $corpus/mask_ranks 2>/dev/null
"$build/bin/raster_fuzz" $corpus/raster 2>/dev/null
for target in reader validator; do
    own=()
    [ -d $corpus/$target ] && own=($corpus/$target)
    "$build/bin/${target}_fuzz" format_spec/vectors/valid format_spec/vectors/invalid "${own[@]}" 2>/dev/null
done
llvm-profdata-14 merge -sparse "$build"/profiles/*.profraw -o "$build/merged.profdata"

objects=("$build/bin/format_tests")
for target in "${targets[@]}"; do
    objects+=(-object "$build/bin/${target}_fuzz")
done
llvm-cov-14 export -format=lcov -instr-profile="$build/merged.profdata" "${objects[@]}" >"$build/coverage.lcov"
python3 - "$build" "$least" "${sources[@]}" <<'PY'
import sys
from pathlib import Path

build, least, wanted = Path(sys.argv[1]), float(sys.argv[2]), {str(Path(name).resolve()) for name in sys.argv[3:]}
files, name = {}, None
for line in (build / "coverage.lcov").read_text().splitlines():
    key, _, value = line.partition(":")
    if key == "SF":
        name = value
    elif key == "DA":
        number, count = value.split(",")[:2]
        counts = files.setdefault(name, {})
        counts[int(number)] = counts.get(int(number), 0) + int(count)
uncovered, covered_lines, all_lines = [], 0, 0
print(f"{'file':<24}{'lines':>7}{'run':>7}{'%':>8}")
for path, counts in sorted(files.items()):
    if str(Path(path).resolve()) not in wanted:
        continue
    run = sum(1 for count in counts.values() if count)
    covered_lines, all_lines = covered_lines + run, all_lines + len(counts)
    print(f"{Path(path).name:<24}{len(counts):>7}{run:>7}{100 * run / len(counts):>8.1f}")
    text = Path(path).read_text(encoding="utf-8").splitlines()
    uncovered += [f"{Path(path).name}:{number}: {text[number - 1].strip()}" for number, count in sorted(counts.items()) if not count]
share = 100 * covered_lines / all_lines
print(f"{'all':<24}{all_lines:>7}{covered_lines:>7}{share:>8.1f}")
(build / "uncovered.txt").write_text("\n".join(uncovered) + "\n")
print(f"{len(uncovered)} lines that nothing ran: {build}/uncovered.txt")
sys.exit(0 if share >= least else f"less than {least} % of the lines")
PY
