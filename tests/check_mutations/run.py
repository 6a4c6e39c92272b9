#!/usr/bin/env python3
"""Removes every check of the reading side, one after the other, and says which of them no test misses: run.py [--vectors] BUILD
[NUMBER...]

BUILD holds the program `check_mutations`. Each check is removed by a switch in the environment; the tests run, those
first that refute the most, until one of them fails. A check that nobody misses must stand, with its reason, in
unreachable.csv; a line there whose check is missed after all, or is there no more, is as wrong. Numbers choose checks; with --vectors no
other tests run but those of format_spec/vectors.
Exit code 0: every check is missed or excused, 1: not.
"""

import concurrent.futures
import csv
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
# The vectors miss most checks, in a tenth of a second; then what is quick, then all that has to do with reading.
SLOW = "Damage.*:MappedDamage.*:Filters.Every*:File.*:TiledImage.*"
UNRELATED = "Normal.*:MaskRanks.*:DetailLevels.*:File.BytesDepend*:MappedStorage.BytesDoNot*"
STAGES = ["Vectors.*:SingleCheck.*", f"-Vectors.*:SingleCheck.*:{SLOW}:{UNRELATED}", f"{SLOW}-{UNRELATED}"]
CPU_SECONDS = 20                                        # a removed check may make a loop endless: that is missed too

def limit():
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

def misses(program, number, selection):
    environment = os.environ | {"PBM_REMOVED_CHECK": str(number)}
    return subprocess.run([program, f"--gtest_filter={selection}", "--gtest_fail_fast", "--gtest_brief=1"],
                          env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=limit,
                          check=False).returncode != 0

def is_missed(program, number, stages):
    return any(misses(program, number, selection) for selection in stages)

def read_excuses():
    """{(file, text): [reason, times used]}; one text may stand in a file more than once."""
    with open(HERE / "unreachable.csv", newline="", encoding="utf-8") as table:
        return {(row["file"], row["text"]): [row["reason"], 0] for row in csv.DictReader(table)}

def report(checks, survivors, excuses, seconds, whole):
    by_file = {}
    for check in checks:
        row = by_file.setdefault(check["file"], [0, 0, 0])
        row[0] += 1
    open_ones = []
    for check in survivors:
        excuse = excuses.get((check["file"], check["text"]))
        by_file[check["file"]][1 if excuse else 2] += 1
        if excuse:
            excuse[1] += 1
        else:
            open_ones.append(check)
    print(f"{'file':<24}{'checks':>8}{'caught':>8}{'excused':>9}{'survived':>10}")
    for file, (total, excused, left) in [*by_file.items(), ("all", [sum(column) for column in zip(*by_file.values())])]:
        print(f"{file:<24}{total:>8}{total - excused - left:>8}{excused:>9}{left:>10}")
    for check in open_ones:
        print(f"survived: {check['number']} {check['file']}:{check['line']}: {check['text']}")
    stale = [key for key, (_, used) in excuses.items() if used == 0] if whole else []
    for file, text in stale:
        print(f"no excuse needed: {file}: {text}")
    print(f"{seconds:.0f} seconds")
    return 1 if open_ones or stale else 0

def main(build, quick, numbers):
    stages = STAGES[:1] if quick else STAGES
    program = str(Path(build, "bin", "check_mutations").resolve())
    checks = json.loads(Path(build, "tests/check_mutations/switched/checks.json").read_text(encoding="utf-8"))
    if numbers:
        checks = [check for check in checks if str(check["number"]) in numbers]
    if not checks:
        sys.exit("no checks")
    if is_missed(program, 0, stages):
        sys.exit("the tests fail with every check in its place")
    start = time.monotonic()
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        missed = list(pool.map(lambda check: is_missed(program, check["number"], stages), checks))
    survivors = [check for check, found in zip(checks, missed) if not found]
    return report(checks, survivors, read_excuses(), time.monotonic() - start, not numbers and not quick)

if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    arguments = [argument for argument in sys.argv[1:] if argument != "--vectors"]
    sys.exit(main(arguments[0], "--vectors" in sys.argv, arguments[1:]))
