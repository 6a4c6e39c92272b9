#!/usr/bin/env python3
"""--sarif and --junit say what --json says, in the forms of their standards: check_sarif.py ROOT PROGRAMS WORK"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import urllib.parse
import xml.etree.ElementTree as ElementTree

try:
    import jsonschema
except ModuleNotFoundError:
    print("skipped: the Python package jsonschema is missing (python3-jsonschema)")
    sys.exit(77)

root, programs, work = (pathlib.Path(word).resolve() for word in sys.argv[1:])
work = work / "sarif"
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
vectors = root / "format_spec/vectors"
ours = json.loads((root / "tests/build_systems/sarif.schema.json").read_text())
schemas = [jsonschema.Draft202012Validator(ours)]
official = list((root / "build/sarif").rglob("sarif-2.1.0*.json"))
if official:
    schemas.append(jsonschema.Draft7Validator(json.loads(official[0].read_text()),
                                              format_checker=jsonschema.FormatChecker()))
faults, results_seen, notes_seen = [], 0, 0


def expect(condition, what):
    if not condition:
        faults.append(str(what))


def run(*words, **options):
    return subprocess.run([programs / "pbm-validate", *map(str, words)], cwd=work, capture_output=True, **options)


def compare(words, stdin=None):
    """The three documents of one run agree. Returns the SARIF."""
    global results_seen, notes_seen
    run("--json=all.json", *words, input=stdin)
    done = run("--sarif=all.sarif", "--junit=all.xml", *words, input=stdin)
    text = run(*words, input=stdin)
    expect((done.stdout, done.stderr, done.returncode) == (text.stdout, text.stderr, text.returncode),
           f"{words}: the text is another with documents")
    report = json.loads((work / "all.json").read_text())
    sarif = json.loads((work / "all.sarif").read_text())
    for schema in schemas:
        for error in schema.iter_errors(sarif):
            faults.append(f"{words}: {error.json_path}: {error.message}")
    sarif_run, = sarif["runs"]
    driver, invocation = sarif_run["tool"]["driver"], sarif_run["invocations"][0]
    expect(invocation["exitCode"] == report["exit_code"] == done.returncode, f"{words}: exit code")
    notes = invocation.get("toolExecutionNotifications", [])
    expect(invocation["executionSuccessful"] == (not notes), f"{words}: {len(notes)} notes of a successful run")
    found = {i: [] for i in range(len(report["files"]))}
    prints = set()
    for entry in [*sarif_run["results"], *notes]:
        physical = entry["locations"][0]["physicalLocation"]
        index = physical["artifactLocation"]["index"]
        found[index].append(entry["properties"])
        code = entry["properties"]["code"]
        artifact = sarif_run["artifacts"][index]
        if "ruleId" in entry:
            results_seen += 1
            expect(entry["ruleId"] == code == driver["rules"][entry["ruleIndex"]]["id"], f"{words}: rule of {code}")
            offset, length = physical["region"]["byteOffset"], physical["region"]["byteLength"]
            expect(offset == entry["properties"]["offset"] and (length == 1) == (offset < artifact["length"]), entry)
            identity = (index, *entry["partialFingerprints"].values())
            expect(identity not in prints, f"{words}: two findings have the fingerprint {identity}")
            prints.add(identity)
        else:
            notes_seen += 1
            descriptor = driver["notifications"][entry["descriptor"]["index"]]
            expect(entry["descriptor"]["id"] == code == descriptor["id"], f"{words}: notification {code}")
            expect("region" not in physical, f"{words}: {code} has an offset")
        expect(entry["message"]["text"].startswith(entry["properties"]["message"]), entry)
    suites = ElementTree.parse(work / "all.xml").getroot()
    cases = suites.findall("testsuite/testcase")
    counts = {"tests": len(cases), "failures": len(suites.findall(".//failure")), "errors": len(suites.findall(".//error"))}
    for element in (suites, suites[0]):
        expect({name: int(element.get(name)) for name in counts} == counts, f"{words}: {element.attrib}")
    expect(len(cases) == len(report["files"]) == len(sarif_run["artifacts"]), f"{words}: another number of files")
    for i, (file, case, artifact) in enumerate(zip(report["files"], cases, sarif_run["artifacts"])):
        expect(found[i] == file["findings"], f"{file['file']}: other findings")
        expect(artifact["properties"] == {k: v for k, v in file.items() if k != "findings"}, f"{file['file']}: figures")
        expect(case.get("classname") == "pbm-validate." + report["level"], case.attrib)
        expect((case.find("failure") is None and case.find("error") is None) == file["valid"], case.attrib)
        said = "".join(case.itertext())
        expect(all(finding["code"] in said for finding in file["findings"]), f"{file['file']}: JUnit leaves a code out")
    return sarif


for level in ("--quick", "--deep", "--strict"):
    sarif = compare([level, "-r", vectors, "/no/such/file", "/dev/zero"])
    hashed = ["hashes" in artifact for artifact in sarif["runs"][0]["artifacts"]]
    expect(any(hashed) == (level != "--quick"), f"{level}: hashes")
compare(["--max-memory", "1", vectors / "valid/smallest.pbvg"])
compare(["--ignore", "raster", "--max-per-code", "1", "-r", vectors / "invalid"])
expect(results_seen > 300 and notes_seen >= 7, f"{results_seen} results, {notes_seen} notes")

# The hash is that of xxh128sum, where that is installed; the codes are all there, with links to anchors.
model = vectors / "valid/smallest.pbvg"
artifact = compare([model])["runs"][0]["artifacts"][0]
expect(artifact["location"]["uri"] == "file://" + urllib.parse.quote(str(model)), artifact)
expect(artifact["length"] == model.stat().st_size, artifact)
try:
    import xxhash
    expect(artifact["hashes"]["xxh128"] == xxhash.xxh3_128_hexdigest(model.read_bytes()), artifact)
except ModuleNotFoundError:
    pass
driver = sarif["runs"][0]["tool"]["driver"]
codes = json.loads(run("--list-codes", "--json").stdout)["codes"]
listed = {rule["id"]: rule for rule in [*driver["rules"], *driver["notifications"]]}
expect(sorted(listed) == sorted(code["code"] for code in codes), "other rules than --list-codes")
specification = (root / "format_spec/BVG.md").read_text()
for code in codes:
    help_text = listed[code["code"]]["help"]
    expect(help_text["text"] == code["meaning"] + " " + code["remedy"], help_text)
    expect(re.findall(r"\(BVG\.md#([0-9.]+)\)", help_text["markdown"]) == code["rules"], help_text)
    expect(all(re.search(rf"\b{re.escape(rule)} \*\*R\*\*", specification) or rule in specification
               for rule in code["rules"]), code)

# Names that are no URI and no XML: spaces, quotes, control characters, bytes that are no UTF-8. Standard input.
odd = work / os.fsdecode(b"odd <\"&'> %41 \x01\x1b \xff\xc3\xa9:#?.pbvg")
shutil.copy(vectors / "invalid/4.2-zero-mask.pbvg", odd)
sarif = compare([odd.name])
uri = sarif["runs"][0]["artifacts"][0]["location"]["uri"]
expect(urllib.parse.unquote_to_bytes(uri) == os.fsencode(odd.name), uri)
sarif = compare(["-"], stdin=(vectors / "valid/smallest.pbvg").read_bytes())
expect("uri" not in sarif["runs"][0]["artifacts"][0]["location"], "standard input has a URI")

# Outputs: alone to standard output; what would destroy something is refused; a disk that is full.
for option in ("--sarif", "--junit"):
    alone = run(option, odd.name)
    expect(alone.returncode == 3 and alone.stdout == (work / f"all.{'xml' if 'junit' in option else 'sarif'}")
           .read_bytes() or b"odd" in alone.stdout, f"{option} alone")
    expect(run(f"{option}={odd.name}", odd.name).returncode == 1, f"{option} replaces an input")
    expect(run(option, "--json", odd.name).returncode == 1, f"{option} and --json on standard output")
    expect(run(f"{option}=missing/x", odd.name).returncode in (1, 2), f"{option} into a folder that is not there")
    full = subprocess.run([programs / "pbm-validate", option, odd.name], cwd=work, stdout=open("/dev/full", "wb"),
                          stderr=subprocess.PIPE)
    expect(full.returncode == 2 or full.returncode == 3 and full.stderr, f"{option} to a full disk: {full}")
expect(odd.read_bytes() == (vectors / "invalid/4.2-zero-mask.pbvg").read_bytes(), "an input was replaced")

print("\n".join(faults[:40] + [f"{results_seen} results, {len(schemas)} schemas, {len(faults)} faults"]))
sys.exit(1 if faults else 0)
