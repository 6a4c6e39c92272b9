"""Checks the second decoder against the test vectors: check_vectors.py FOLDER [valid.pbvg ...]

Every file of FOLDER/valid, and every further file named, must decode; every file of FOLDER/invalid must be refused with
the kind, the offset and the rule that FOLDER/invalid/table.csv names. A reader, which does not validate, must refuse those
whose rule has the mark R in BVG.md and read those whose rule has the mark V. Exit code 0: all did, 1: some did not,
77: Python packages are missing.
"""

import csv
import sys
from pathlib import Path

try:
    import bvg
    import check_text
except ModuleNotFoundError as missing:
    print(f"skipped: the Python package {missing.name} is missing (python3-zstandard, python3-xxhash)")
    sys.exit(77)

VALID = ("valid", None, None)

def text(code, offset, rule):
    return code if rule is None else f"{code} at {offset} (rule {rule})"

def outcome(path, validates=True):
    """(code, offset, rule) of the refusal, or VALID."""
    try:
        bvg.read(path.read_bytes(), validates=validates)
    except bvg.BvgError as error:
        return error.code, error.offset, error.rule
    return VALID

def wrong_answer(path, expected):
    """What is wrong with the decoder's answer for a file that must give (code, offset, rule), or None."""
    try:
        answer = outcome(path)
    except Exception as error:                          # a decoder must never end otherwise
        return f"{path.name}: {type(error).__name__}: {error}"
    return None if answer == expected else f"{path.name}: {text(*answer)}, not {text(*expected)}"

def wrong_mark(path, expected, marks):
    """What is wrong with a reader's answer for a file that breaks a rule, or None."""
    rule = expected[2]
    answer = outcome(path, validates=False)
    mark = marks[rule] if len(marks[rule]) == 1 else "V" if "unknown" in path.name else "R"     # 3.2.14
    right = VALID if mark == "V" else expected
    return None if answer == right else f"{path.name}: rule {rule} is marked {marks[rule]}, a reader says {text(*answer)}"

def main(folder, further):
    invalid = Path(folder, "invalid")
    with open(invalid / "table.csv", newline="", encoding="utf-8") as table:
        cases = [(invalid / row["file"], (row["kind"], int(row["offset"]), row["message"].split()[0]))
                 for row in csv.DictReader(table)]
    marks = check_text.marks()
    wrong = [wrong_mark(*case, marks) for case in cases]
    listed = {path.name for path, _ in cases}
    cases += [(path, ("a code: it is not in the table", None, None))
              for path in sorted(invalid.glob("*.pbvg")) if path.name not in listed]
    valid = sorted(Path(folder, "valid").glob("*.pbvg"))
    if not cases or not valid:
        sys.exit(f"{folder}: no vectors")
    cases += [(path, VALID) for path in valid + [Path(name) for name in further]]
    wrong += [wrong_answer(path, expected) for path, expected in cases]
    wrong = list(filter(None, wrong))
    print("\n".join(wrong), end="\n" if wrong else "")
    print(f"{len(cases) - len(wrong)} passed, {len(wrong)} failed")
    return 1 if wrong else 0

if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], sys.argv[2:]))
