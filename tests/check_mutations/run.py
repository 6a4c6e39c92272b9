#!/usr/bin/env python3
"""Makes one mutation of the code after the other, and says which of them no test fails on: run.py [--vectors] BUILD [NUMBER...]
run.py --values BUILD [NUMBER...]

Without --values each check of the reading side is removed; BUILD holds the program `check_mutations`. With it each row of
mutations.csv is another value of a constant, a comparison or a rounding of the builder and the renderers; BUILD holds the
programs FAMILY_mutations. A switch in the environment makes the mutation; the tests run until one of them fails: for checks
those first that catch the most, for values those that the row names. A mutation that no test catches must have its reason
in unreachable.csv (checks) or in its row; a reason for one that is caught after all, or is there no more, is as wrong.
Numbers choose mutations; with --vectors no other tests run but those of format_spec/vectors.
Exit code 0: every mutation is caught or excused, 1: not.
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
# The vectors catch most checks, in a tenth of a second; then what is quick, then all that has to do with reading.
SLOW = "Damage.*:MappedDamage.*:Filters.Every*:File.*:TiledImage.*"
UNRELATED = "Normal.*:MaskRanks.*:DetailLevels.*:File.BytesDepend*:MappedStorage.BytesDoNot*"
CHECKS = ["Vectors.*:SingleCheck.*", f"-Vectors.*:SingleCheck.*:{SLOW}:{UNRELATED}", f"{SLOW}-{UNRELATED}"]
CPU_SECONDS = {"checks": 20, "values": 600}             # a mutation may make a loop endless: that is caught too

class Run:
    def __init__(self, build, kind):
        self.build, self.kind = Path(build), kind

    def mutations(self):
        """Each with its program and its stages, which are filters of tests."""
        folder = self.build / "tests/check_mutations"
        if self.kind == "checks":
            checks = json.loads((folder / "switched/checks.json").read_text(encoding="utf-8"))
            return [check | {"program": "check_mutations", "stages": CHECKS} for check in checks]
        rows = []
        for listing in sorted(folder.glob("*_values.json")):
            program = listing.name.replace("_values.json", "_mutations")
            rows += [row | {"program": program, "stages": [row["tests"]]}
                     for row in json.loads(listing.read_text(encoding="utf-8"))]
        return rows

    def fails(self, program, number, selection):
        def limit():
            resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS[self.kind],) * 2)
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        return subprocess.run([(self.build / "bin" / program).resolve(), f"--gtest_filter={selection}", "--gtest_fail_fast",
                               "--gtest_brief=1"], env=os.environ | {"PBM_SWITCH": str(number)}, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL, preexec_fn=limit, check=False).returncode != 0

    def is_caught(self, mutation, quick):
        stages = mutation["stages"][:1] if quick else mutation["stages"]
        return any(self.fails(mutation["program"], mutation["number"], selection) for selection in stages)

def read_excuses(kind, mutations):
    """{(file, text): [reason, times used]}; one text may stand in a file more than once."""
    if kind == "values":
        return {(row["file"], row["text"] + row["mutant"]): [row["reason"], 0] for row in mutations if row["reason"]}
    with open(HERE / "unreachable.csv", newline="", encoding="utf-8") as table:
        return {(row["file"], row["text"]): [row["reason"], 0] for row in csv.DictReader(table)}

def report(mutations, survivors, excuses, seconds, whole):
    by_file = {}
    for mutation in mutations:
        row = by_file.setdefault(mutation["file"], [0, 0, 0])
        row[0] += 1
    open_ones = []
    for mutation in survivors:
        excuse = excuses.get((mutation["file"], mutation["text"] + mutation.get("mutant", "")))
        by_file[mutation["file"]][1 if excuse else 2] += 1
        if excuse:
            excuse[1] += 1
        else:
            open_ones.append(mutation)
    width = max(map(len, by_file)) + 2
    print(f"{'file':<{width}}{'mutations':>10}{'caught':>8}{'excused':>9}{'open':>6}")
    for file, (total, excused, left) in [*by_file.items(), ("all", [sum(column) for column in zip(*by_file.values())])]:
        print(f"{file:<{width}}{total:>10}{total - excused - left:>8}{excused:>9}{left:>6}")
    for one in open_ones:
        mutant = f"  ->  {one['mutant']}" if "mutant" in one else ""
        print(f"not caught: {one['number']} {one['file']}:{one['line']}: {one['text']}{mutant}")
    stale = [key for key, (_, used) in excuses.items() if used == 0] if whole else []
    for file, text in stale:
        print(f"no excuse needed: {file}: {text}")
    print(f"{seconds:.0f} seconds")
    return 1 if open_ones or stale else 0

def main(build, kind, quick, numbers):
    run = Run(build, kind)
    mutations = run.mutations()
    excuses = read_excuses(kind, mutations)
    if numbers:
        mutations = [mutation for mutation in mutations if str(mutation["number"]) in numbers]
    if not mutations:
        sys.exit("no mutations")
    for program in {mutation["program"] for mutation in mutations}:
        selections = {selection for mutation in mutations if mutation["program"] == program
                      for selection in mutation["stages"][:1 if quick else None]}
        if any(run.fails(program, 0, selection) for selection in sorted(selections)):
            sys.exit(f"{program}: the tests fail without a mutation")
    start = time.monotonic()
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        caught = list(pool.map(lambda mutation: run.is_caught(mutation, quick), mutations))
    survivors = [mutation for mutation, found in zip(mutations, caught) if not found]
    return report(mutations, survivors, excuses, time.monotonic() - start, not numbers and not quick)

if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    if not words:
        sys.exit(__doc__)
    sys.exit(main(words[0], "values" if "--values" in sys.argv else "checks", "--vectors" in sys.argv, words[1:]))
