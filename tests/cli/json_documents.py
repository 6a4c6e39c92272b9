#!/usr/bin/env python3
"""Every JSON document that a program writes conforms to its schema, also where the program fails:
json_documents.py PROGRAMS ROOT WORK"""
import errno
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys

try:
    import jsonschema
except ModuleNotFoundError:
    print("skipped: the Python package jsonschema is missing (python3-jsonschema)")
    sys.exit(77)

programs, root, work = map(pathlib.Path, sys.argv[1:])
SCHEMAS = {
    "failure": "command_line/failure.schema.json",
    "pbm-build": "tools/pbm-build/report.schema.json",
    "batch": "tools/pbm-build/batch.schema.json",
    "pbm-export": "tools/pbm-export/report.schema.json",
    "pbm-info": "tools/pbm-info/report.schema.json",
    "pbm-render": "runtime/viewer/pbm-render/report.schema.json",
    "pbm-validate": "tools/pbm-validate/report.schema.json",
    "codes": "tools/pbm-validate/codes.schema.json",
}
validators = {}
for schema_name, path in SCHEMAS.items():
    schema = json.loads((root / path).read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    validators[schema_name] = jsonschema.Draft202012Validator(schema)

shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
faults, documents = [], 0


def expect(condition, what):
    if not condition:
        faults.append(what)


def conforms(schema, document, what):
    global documents
    documents += 1
    for error in validators[schema].iter_errors(document):
        faults.append(f"{what}: {error.json_path}: {error.message}")


def run(program, *arguments):
    return subprocess.run([programs.resolve() / program, *map(str, arguments)], cwd=work, capture_output=True,
                          stdin=subprocess.DEVNULL, timeout=300)


def succeeds(program, *arguments, schema=None):
    """The document on standard output is the same as in a file, but for times and memory."""
    what = " ".join(map(str, (program, *arguments)))
    done = run(program, *arguments, "--json")
    expect(done.returncode == 0, f"{what}: exit code {done.returncode}, {done.stderr}")
    document = json.loads(done.stdout)
    conforms(schema or program, document, what)
    expect(run(program, *arguments, "--json=document.json").returncode == 0, what)
    in_file = json.loads((work / "document.json").read_text())
    conforms(schema or program, in_file, what)
    expect(document.keys() == in_file.keys(), f"{what}: {document.keys()} and {in_file.keys()}")
    return document


def fails(code, error, program, *arguments):
    """The document of a failure, on standard output and in a file that holds an older document."""
    what = " ".join(map(str, (program, *arguments)))
    (work / "document.json").write_text("{}\n")
    done, in_file = run(program, *arguments, "--json"), run(program, *arguments, "--json=document.json")
    document = json.loads(done.stdout)
    conforms("failure", document, what)
    expect(json.loads((work / "document.json").read_text()) == document, f"{what}: another document in a file")
    expect((document["program"], document["exit_code"]) == (program, code), f"{what}: {document}")
    expect(done.returncode == in_file.returncode == code, f"{what}: exit codes {done.returncode}, {in_file.returncode}")
    said = done.stderr.decode(errors="replace")
    expect(said.count("\n") == 1 and document["error"]["message"] in said, f"{what}: {said} and {document}")
    for key, value in error.items():
        expect(document["error"][key] == value, f"{what}: {key} is {document['error'][key]}, expected {value}")
    return document["error"]


HEADER = ("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
          "property float quality\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n")
BODY = "0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2\n"
(work / "scan.ply").write_text(HEADER + BODY)
(work / "other.ply").write_text(HEADER + BODY)
(work / "cut.ply").write_text((HEADER + BODY)[:-8])
(work / "empty.ply").write_text("")

# What each program writes, with all that is optional.
built = succeeds("pbm-build", "scan.ply", "--depth", 6, "-o", "plain.pbvg")
expect(built["seconds"] >= sum(step["seconds"] for step in built["steps"]), f"pbm-build: {built['seconds']} s and its steps")
succeeds("pbm-build", "scan.ply", "other.ply", "--depth", 6, "--mesh-report", "-o", "meshes.pbvg")
succeeds("pbm-build", "scan.ply", "other.ply", "--depth", 6, "-o", "two.pbvg", "--if-changed")
expect(succeeds("pbm-build", "scan.ply", "other.ply", "--depth", 6, "-o", "two.pbvg", "--if-changed")["outcome"] ==
       "up to date", "pbm-build --if-changed: not up to date")
succeeds("pbm-build", "scan.ply", "--depth", 6, "--lights", "studio", "--shadows", "--ground", "wood", "--texture",
         "marble", "--panorama", "default", "--panorama-width", 256, "--material", "gold", "--unit", "mm", "-o", "scene.pbvg")
succeeds("pbm-build", "scan.ply", "--depth", 6, "--name", "\u00e4 \"quoted\" name", "-o", "with \u00e4.pbvg")
succeeds("pbm-build", "scan.ply", "--depth", 6, "--field", "quality", "--fill-holes", 3, "-o", "field.pbvg")
(work / "rich.mtl").write_text("newmtl red\nKd 1 0 0\nKe 1 0 0\nmap_Kd -bm 1 no.png\nPr 1\n")
(work / "rich.obj").write_text("mtllib rich.mtl\ng a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt 0 0 0.5\nusemtl red\nlod 1\n"
                               "csh -ls\ncstype bezier\nmy 1\nf 1/1/1 2/1/1 3/1/7\nusemtl none\nf 1 2 3\nl 1 2")
said = run("pbm-build", "rich.obj", "--depth", 6, "-o", "rich.pbvg").stdout.decode().splitlines()[:-1]
lines = [f"{line['name']}: {line['fate']}" + (f" ({line['note']})" if line["note"] else "") +
         (f" [{line['warning']}]" if "warning" in line else "")
         for line in succeeds("pbm-build", "rich.obj", "--depth", 6, "-o", "rich.pbvg")["attributes"]]
expect(lines == said and len(lines) > 15, f"JSON and the report of a scan: {lines} and {said}")
for model in ("plain.pbvg", "scene.pbvg", "field.pbvg", "with \u00e4.pbvg"):
    succeeds("pbm-info", model)
    succeeds("pbm-validate", "--deep", model)
succeeds("pbm-export", "scene.pbvg", "-o", "points.ply")
succeeds("pbm-export", "scene.pbvg", "-o", "points.ply", "--ascii", "--float", "--level", 3)
small = ("--resolution", "40,30")
succeeds("pbm-render", "scene.pbvg", "-o", "picture.png", *small)
drawn = succeeds("pbm-render", "field.pbvg", "-o", "picture.png", "--colour-by", "quality", *small)
(work / "classes.csv").write_text("x,y,z,classification\n" + "".join(f"{i % 9},{i // 9},0,{2 + i % 5}\n" for i in range(81)))
succeeds("pbm-build", "classes.csv", "-o", "classes.pbvg")
classes = succeeds("pbm-render", "classes.pbvg", "-o", "picture.png", "--drop-class", "noise", "--show-class", "ground,9", *small)
expect(classes["look"]["drop_class"] == "7,18" and classes["look"]["show_class"] == "2,9", f"pbm-render: {classes['look']}")
expect(drawn["look"]["colour_by"] == "quality", f"pbm-render: {drawn['look']}")
succeeds("pbm-render", "scene.pbvg", "--bench", 2, "--turntable", "film.avi", "--frames", 2, "--quality", "fine", *small)
succeeds("pbm-validate", "--list-codes", schema="codes")
shutil.copy(work / "scan.ply", os.fsencode(work) + b"/odd \xff.ply")  # no UTF-8: replaced in the document
odd = subprocess.run([programs.resolve() / "pbm-build", b"odd \xff.ply", "--depth", "6", "--json"], cwd=work, capture_output=True)
conforms("pbm-build", json.loads(odd.stdout), "a name that is no UTF-8")

# What they write when they fail.
(work / "damaged.pbvg").write_bytes((work / "plain.pbvg").read_bytes()[:-30])
shutil.copy(root / "format_spec/vectors/invalid/2.5-major-version-7.pbvg", work / "newer.pbvg")
for program, more in {"pbm-build": ("-o", "x.pbvg"), "pbm-export": ("-o", "x.ply"), "pbm-info": (), "pbm-render": ("-o", "x.png")}.items():
    fails(2, {"kind": "io", "file": "none", "offset": None}, program, "none", *more)
    fails(1, {"kind": "usage", "file": None}, program, "none", *more, "--no-such-option")
for program, more in {"pbm-export": ("-o", "x.ply"), "pbm-info": (), "pbm-render": ("-o", "x.png")}.items():
    found = fails(3, {"kind": "truncated", "rule": "2.7", "file": "damaged.pbvg"}, program, "damaged.pbvg", *more)
    expect(found["offset"] is not None and found["code"] == "header.size", f"{program}: {found}")
    fails(5, {"kind": "unsupported_version", "file": "newer.pbvg"}, program, "newer.pbvg", *more)
fails(3, {"kind": "bad_input", "file": "empty.ply"}, "pbm-build", "empty.ply")
expect(fails(3, {"kind": "bad_input", "file": "cut.ply"}, "pbm-build", "scan.ply", "cut.ply", "-o", "x.pbvg")["offset"],
       "a cut scan: no offset")
fails(4, {"kind": "memory"}, "pbm-render", "scene.pbvg", "-o", "x.png", "--max-memory", "1k")
fails(1, {"kind": "usage"}, "pbm-validate")
fails(1, {"kind": "usage"}, "pbm-build", "scan.ply", "-o", "scan.ply")
fails(2, {"kind": "io", "file": "/dev/full"}, "pbm-build", "scan.ply", "-o", "/dev/full")
(work / "recipe.toml").write_text('input = "scan.ply"\nlog = "../log"\n')
fails(1, {"kind": "usage", "file": "recipe.toml"}, "pbm-build", "--recipe", "recipe.toml")

# A batch writes a line for each scan.
os.mkfifo(work / "endless.ply")
(work / "list").write_text("scan.ply\ncut.ply\nnone.ply\n")
(work / "waiting").write_text("scan.ply\ncut.ply\nnone.ply\nendless.ply\n")
batch = ("--output-dir", "models", "--keep-going", "--depth", 6, "-j", 1, "-q", "--timeout", 5, "--batch")
done, in_file = run("pbm-build", *batch, "waiting", "--json"), run("pbm-build", *batch, "list", "--json=lines")
for text, codes in ((done.stdout, [0, 3, 2, 4]), ((work / "lines").read_bytes(), [0, 3, 2])):
    lines = [json.loads(line) for line in text.splitlines()]
    expect([line["exit_code"] for line in lines] == codes, f"a batch: {lines}")
    for line in lines:
        conforms("batch", line, "a batch")
        expect("pbm-build" not in line["message"] and line["input"] not in line["message"], f"{line}: names in the message")
        expect((line["message"] == "") == (line["exit_code"] == 0), line)
        if line["report"] is not None:
            conforms("failure" if line["exit_code"] else "pbm-build", line["report"], "a scan of a batch")
expect(b"--timeout" in done.stdout.splitlines()[-1] and b"--timeout" in done.stderr, f"a batch: {done}")
expect(done.returncode == in_file.returncode == 3, f"a batch: {done} {in_file}")
full = subprocess.run([programs.resolve() / "pbm-build", *map(str, batch), "list", "--json=lines"], cwd=work, text=True,
                      capture_output=True, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)))
expect(full.returncode == 2 and full.stderr.endswith(f"pbm-build: lines: cannot write: {os.strerror(errno.EFBIG)}\n"), full)

# What is no document stays: inputs, and files that a wrong command line names.
for name, arguments in {"scan.ply": ("scan.ply", "-o", "x.pbvg"), "cut.ply": ("scan.ply", "-o", "x.pbvg", "--no-such-option")}.items():
    before = (work / name).read_bytes()
    done = run("pbm-build", *arguments, f"--json={name}")
    expect(done.returncode == 1 and (work / name).read_bytes() == before, f"--json={name}: {done}")

print("\n".join(faults + [f"{documents} documents, {len(faults)} faults"]))
sys.exit(1 if faults else 0)
