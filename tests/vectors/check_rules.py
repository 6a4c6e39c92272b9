#!/usr/bin/env python3
"""Compares code, specification, catalogue, docs and invalid files: check_rules.py ROOT PBM_VALIDATE [--write]

- Every rule of BVG.md belongs to one code of the catalogue, is verified in pbm_format, and has an invalid file or, below,
  a reason why it has none.
- The table of section 9 of BVG.md and that of docs/reference/validator-codes.md agree with the catalogue (--write updates them).
"""
import json
import pathlib
import re
import subprocess
import sys

root, program = pathlib.Path(sys.argv[1]), sys.argv[2]
write = sys.argv[3:] == ["--write"]
WITHOUT_FILE = {
    "3.1.4": "sections of together 512 TiB: below that 3.2.10 or 3.2.11 comes first",
    "4.3": "for programs; the directories show it for files (5.5.7)",
    "4.5": "for programs: a limit of the caller",
}
RULE = r"\d+\.\d+(?:\.\d+)?"
faults = []


def list_codes(*arguments):
    return subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout


def check_equal(path, start, expected):
    """The block of lines of a file that starts with the line `start` is `expected`."""
    text = path.read_text(encoding="utf-8")
    at = text.index(start)
    end = re.compile(r"\n(?!\|)").search(text, at).start() + 1
    if text[at:end] == expected:
        return
    if write:
        path.write_text(text[:at] + expected + text[end:], encoding="utf-8")
    else:
        faults.append(f"{path.name}: the table of codes is not that of the catalogue: run check_rules.py with --write")


codes = json.loads(list_codes("--list-codes", "--json"))["codes"]
listed = [rule for code in codes for rule in code["rules"]]
spec = root / "format_spec/BVG.md"
stated = set(re.findall(rf"^- ({RULE}) ", spec.read_text(encoding="utf-8"), re.MULTILINE))
named = set()
for source in (root / "format_spec/pbm_format").rglob("*.cpp"):
    named |= set(re.findall(rf'"({RULE})"', source.read_text(encoding="utf-8")))
vectors = {path.name.split("-")[0] for path in (root / "format_spec/vectors/invalid").glob("*.pbvg")}

faults += [f"rule {rule} belongs to several codes" for rule in sorted({r for r in listed if listed.count(r) > 1})]
faults += [f"rule {rule} belongs to no code" for rule in sorted(stated - set(listed))]
faults += [f"rule {rule} of the catalogue is not in BVG.md" for rule in sorted(set(listed) - stated)]
faults += [f"rule {rule} is verified nowhere" for rule in sorted(set(listed) - named)]
faults += [f"rule {rule} has no bad file" for rule in sorted(named - vectors - set(WITHOUT_FILE))]
faults += [f"rule {rule} has a bad file but is excused" for rule in sorted(vectors & set(WITHOUT_FILE))]
faults += [f"rule {rule} has a bad file but no code names it" for rule in sorted(vectors - named)]

check_equal(root / "docs/reference/validator-codes.md", "| code | severity |", list_codes("--list-codes=markdown"))
rows = [f"| `{code['code']}` | {', '.join(code['rules'])} | `{code['kind']}` | {code['exit_code']} |\n"
        for code in codes if code["severity"] == "error"]
check_equal(spec, "| code | rules |", "| code | rules | kind | exit code |\n|---|---|---|---|\n" + "".join(rows))

print("\n".join(faults) or f"{len(codes)} codes, {len(named)} rules, {len(vectors)} with a bad file, {len(WITHOUT_FILE)} excused")
sys.exit(1 if faults else 0)
