#!/usr/bin/env python3
"""What the readers make of odd and damaged scans, against tables of what is right.

  check_odd.py own DESCRIBE_SCAN WORK_FOLDER                     our own small files: files/, and those of make_*.py
  check_odd.py scans DESCRIBE_SCAN UNPACKED SOURCE [SCANS]       real scans; skipped (77) where there are none
  check_odd.py inputs DESCRIBE_SCAN UNPACKED SOURCE [SCANS]      real scans in other formats; skipped likewise

Columns of own_files.csv, real_scans.csv and real_inputs.csv: `exit` is 0 where a file loads, else the exit code of the refusal; counts
and attributes (colours, normals, radii, materials) of what loaded; `says`: texts, separated by " | ", that the message
or the report of attributes must contain; `why`: what is particular about the file. Every word of `why` in
the tables of real files must also stand in own_files.csv: what real files need is tested where they are not at hand.

SCANS is a folder of scans that has folders `odd` and `inputs`, found as scan_folder.py says.
"""

import csv
import json
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from scan_folder import find_inputs, find_scans

COUNTS = ("vertices", "triangles", "dropped_vertices", "dropped_triangles")


def table(name):
    with open(HERE / name, newline="") as file:
        return list(csv.DictReader(file))


def words(rows):
    return {word for row in rows for word in row["why"].split()}


def describe(program, paths):
    run = subprocess.run([program, *map(str, paths)], capture_output=True, text=True, timeout=600)
    lines = run.stdout.splitlines()
    if run.returncode != 0 or len(lines) != len(paths):
        sys.exit(f"{program}: {run.returncode} after {len(lines)} of {len(paths)} files: {run.stderr}")
    return [json.loads(line) for line in lines]


def problems(row, found):
    if found["exit"] != int(row["exit"]):
        return [f"exit {found['exit']} instead of {row['exit']}: {found.get('message', found)}"]
    wrong = []
    if found["exit"] == 0:
        wrong = [f"{name} {found[name]} instead of {row[name]}" for name in COUNTS if found[name] != int(row[name])]
        if found["attributes"] != row["attributes"].split():
            wrong.append(f"attributes {found['attributes']} instead of {row['attributes']}")
    text = found.get("message") or "\n".join(found["report"])
    wrong += [f"does not say '{part}' but {text!r}" for part in row["says"].split(" | ") if part not in text]
    return wrong


def check(program, rows, folder):
    failed = 0
    for row, found in zip(rows, describe(program, [folder / row["file"] for row in rows])):
        for problem in problems(row, found):
            print(f"{row['file']}: {problem}")
            failed += 1
    print(f"{len(rows)} files, {failed} problems")
    return failed


def same_files(rows, there):
    listed = {row["file"] for row in rows}
    wrong = [f"{name}: has no row in the table" for name in sorted(there - listed)]
    wrong += [f"{name}: is in the table but not there" for name in sorted(listed - there)]
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return len(wrong)


def own_files(program, work):
    import make_clouds
    import make_files

    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(HERE / "files", work)
    for name, content in {**make_files.files(), **make_clouds.files()}.items():
        (work / name).write_bytes(content)
    rows = table("own_files.csv")
    failed = same_files(rows, {path.name for path in work.iterdir()})
    missing = words(table("real_scans.csv") + table("real_inputs.csv")) - words(rows)
    if missing:
        print("no file of our own for:", *sorted(missing))
    return failed + len(missing) or check(program, rows, work)


def real_scans(program, unpacked, source, given):
    scans = find_scans(unpacked, source, given)
    if scans is None or not (scans / "odd").is_dir():
        print("skipped: no folder of scans with a folder 'odd' (PBM_SCANS_DIR)")
        return 77
    there = {str(f.relative_to(scans)) for f in (scans / "odd").rglob("*") if f.is_file()}
    there |= {f.name for f in scans.iterdir() if f.suffix in (".ply", ".obj", ".stl", ".off")}
    rows = table("real_scans.csv")
    return min(1, same_files(rows, there) or check(program, rows, scans))


def real_inputs(program, unpacked, source, given):
    inputs = find_inputs(unpacked, source, given)
    if inputs is None:
        print("skipped: no folder of scans with a folder 'inputs' (PBM_SCANS_DIR)")
        return 77
    rows = table("real_inputs.csv")
    extensions = {pathlib.PurePath(row["file"]).suffix for row in rows}
    there = {str(f.relative_to(inputs)) for f in inputs.rglob("*") if f.suffix in extensions}
    return min(1, same_files(rows, there) or check(program, rows, inputs))


def main():
    mode, program, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3]).resolve()
    if mode == "own":
        folder.mkdir(parents=True, exist_ok=True)
        return min(1, own_files(program, folder))
    given = sys.argv[5] if len(sys.argv) > 5 else ""
    real = real_scans if mode == "scans" else real_inputs
    return real(program, folder, pathlib.Path(sys.argv[4]).resolve(), given)


sys.exit(main())
