#!/usr/bin/env python3
"""The output of pbm-validate --json conforms to its published schema: validate_schema.py PBM_VALIDATE ROOT"""
import json
import pathlib
import subprocess
import sys

try:
    import jsonschema
except ModuleNotFoundError:
    print("skipped: the Python package jsonschema is missing (python3-jsonschema)")
    sys.exit(77)

program, root = sys.argv[1], pathlib.Path(sys.argv[2])
vectors = root / "format_spec/vectors"
schema = json.loads((root / "tools/pbm-validate/report.schema.json").read_text())
jsonschema.Draft202012Validator.check_schema(schema)
validator = jsonschema.Draft202012Validator(schema)
failed, seen = [], set()


def report(*arguments):
    result = subprocess.run([program, "--json", *map(str, arguments)], capture_output=True, timeout=300)
    document = json.loads(result.stdout)
    for error in validator.iter_errors(document):
        failed.append(f"{' '.join(map(str, arguments))}: {error.json_path}: {error.message}")
    if document["exit_code"] != result.returncode:
        failed.append(f"{arguments}: exit code {result.returncode}, not {document['exit_code']}")
    for file in document["files"]:
        counted = file["errors"] + file["warnings"] + file["infos"]
        if sum(file["totals"].values()) != counted or (file["errors"] == 0) != file["valid"]:
            failed.append(f"{file['file']}: the numbers contradict each other")
        seen.update(finding["code"] for finding in file["findings"])
    return document


for level in ("--quick", "--deep", "--errors-only"):
    document = report(level, "-r", vectors, "/no/such/file", "/dev/zero", root)
    if len(document["files"]) < 150:
        failed.append(f"{level}: only {len(document['files'])} files")
report("--max-memory", "1", vectors / "valid/smallest.pbvg")
report("--ignore", "raster,hash.chunk", "-r", vectors / "invalid")

# The schema refuses wrong values.
document = report(vectors / "invalid/4.2-zero-mask.pbvg")
for path in (("level",), ("files", 0, "findings", 0, "code"), ("files", 0, "errors"), ("files", 0, "findings", 0, "offset")):
    broken = json.loads(json.dumps(document))
    at = broken
    for step in path[:-1]:
        at = at[step]
    at[path[-1]] = -1
    if validator.is_valid(broken):
        failed.append(f"the schema accepts a wrong {path}")

listed = json.loads(subprocess.run([program, "--list-codes", "--json"], capture_output=True).stdout)["codes"]
UNSEEN = {"io.read", "limit.nodes", "octree.mask_count"}  # standard input; rules for callers
missing = {code["code"] for code in listed} - seen - UNSEEN
failed += [f"{code} was not seen" for code in sorted(missing)]
print("\n".join(failed + [f"{len(seen)} codes seen, {len(failed)} faults"]))
sys.exit(1 if failed else 0)
