#!/usr/bin/env python3
"""Holds code, specification and bad files together: every rule that the library names stands in BVG.md, and every rule
has a bad file, or stands below with the reason why it has none."""
import pathlib
import re
import sys

root = pathlib.Path(sys.argv[1])
WITHOUT_FILE = {
    "3.1.4": "needs raw sizes near 2^64, which 3.2.10 refuses first",
    "3.1.5": "3.2.3 and 2.7 leave no room for it but a table that ends early",
    "3.1.8": "as 3.1.7",
    "3.3.1": "3.2 rules come first; see the unit tests",
    "4.3": "a call with wrong arguments; the directories prove it for files (5.5.7)",
    "4.5": "a limit of the caller",
    "5.4.3": "a stream of at most 196,608 bytes and at least one stored byte: 5.4.2 and 5.6.3 come first",
    "5.5.4": "a chunk more on level 1: 5.5.3 comes first",
    "5.5.6": "5.5.3 and 5.5.5 come first unless both levels lie",
    "5.5.8": "5.5.10 says the same for the last chunk; see the fuzz target",
    "5.5.9": "5.5.7 comes first unless both levels lie",
    "5.5.11": "5.5.1 and 3.2.13 come first",
}
rule_text = re.compile(r'"(\d+\.\d+(?:\.\d+)?)"')
named = set()
for source in (root / "format_spec/pbm_format").glob("*.cpp"):
    named |= set(rule_text.findall(source.read_text()))
spec = (root / "format_spec/BVG.md").read_text()
stated = set(re.findall(r"(?<![\d.])(\d+\.\d+(?:\.\d+)?) ", spec)) | set(re.findall(r"\((\d+\.\d+(?:\.\d+)?),", spec))
vectors = {path.name.split("-")[0] for path in (root / "format_spec/vectors/invalid").glob("*.bvg")}
faults = [f"rule {rule} is not in BVG.md" for rule in sorted(named - stated)]
faults += [f"rule {rule} has no bad file" for rule in sorted(named - vectors - set(WITHOUT_FILE))]
faults += [f"rule {rule} has a bad file but is excused" for rule in sorted(vectors & set(WITHOUT_FILE))]
faults += [f"rule {rule} has a bad file but no code names it" for rule in sorted(vectors - named)]
print("\n".join(faults) or f"{len(named)} rules named, {len(vectors)} with a bad file, {len(WITHOUT_FILE)} excused")
sys.exit(1 if faults else 0)
