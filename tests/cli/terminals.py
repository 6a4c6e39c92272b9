#!/usr/bin/env python3
"""What programs write to a terminal, by the environment: terminals.py PROGRAMS WORK_FOLDER SOURCE_FOLDER"""

import os
import pathlib
import pty
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from commands import check, must  # noqa: E402

programs, work, source = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def on_terminal(command, **variables):
    """What the command writes to a terminal; a variable that is None is unset."""
    environment = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}", "PYTHONPATH": str(source / "bindings/python")}
    environment |= {name: value for name, value in variables.items() if value is not None}
    for name in (name for name, value in variables.items() if value is None):
        environment.pop(name, None)
    ours, theirs = pty.openpty()
    process = subprocess.Popen(command, cwd=work, env=environment, stdin=theirs, stdout=theirs, stderr=theirs)
    os.close(theirs)
    said = b""
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:  # EIO: the last one who writes has ended
            break
        if not piece:
            break
        said += piece
    os.close(ours)
    check(process.wait() == 0, f"{command}, {variables}: exit code {process.returncode}: {said}")
    return said.replace(b"\r\n", b"\n")  # as the terminal translates


must(programs / "pbm-sample", "-q", "--vertices", "20000", "-o", "scan.ply", cwd=work)
must(programs / "pbm-build", "-q", "scan.ply", "--depth", "7", "-o", "model.pbvg", cwd=work)
(work / "list").write_text("scan.ply\n")
BARS = [["pbm-build", "scan.ply", "--depth", "7", "-o", "out.pbvg"],
        ["pbm-build", "--batch", "list", "--output-dir", "out", "--depth", "6"],
        ["pbm-render", "scan.ply", "--cache", "none", "--resolution", "64,48", "-o", "out.png"],
        ["pbm-render", "model.pbvg", "--resolution", "64,48", "--frames", "3", "--turntable", "out.avi"],
        ["pbm-export", "model.pbvg", "-o", "out.ply"]]
python = next((python for python in (sys.executable, "/usr/bin/python3")
               if subprocess.run([python, "-c", "import numpy"], capture_output=True).returncode == 0), None)
if python:
    BARS.append([python, "-B", "-m", "pbm", "build", "scan.ply", "--depth", "7", "-o", "out.pbvg"])
OTHERS = [["pbm-info", "model.pbvg"], ["pbm-validate", "model.pbvg"], ["pbm-build", "--help"],
          ["pbm-sample", "--vertices", "10000", "-o", "out.ply"]]

for command in BARS + OTHERS:
    for variables in ({"TERM": "dumb"}, {"TERM": None}, {"TERM": ""}, {"TERM": "dumb", "NO_COLOR": "1", "PAGER": "cat"}):
        said = on_terminal(command, **variables)
        check(b"\x1b" not in said and b"\r" not in said and b"\b" not in said, f"{command}, {variables}: {said}")
    for variables in ({"TERM": "xterm", "NO_COLOR": "1", "PAGER": "cat"}, {"TERM": "xterm", "NO_COLOR": None}):
        said = on_terminal(command, **variables)
        check(b"\x1b" not in said, f"{command}, {variables}: {said}")
        # A bar, and spaces over all of it in the end.
        check((b"[" in said and b"\r" in said) == (command in BARS), f"{command}, {variables}: {said}")
        line = said.decode().rpartition("\r")[2] if command in BARS else ""
        check("[=" not in line, f"{command}, {variables} leaves a bar: {said}")
print("passed")
