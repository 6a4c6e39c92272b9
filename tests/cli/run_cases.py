#!/usr/bin/env python3
"""Runs the command lines of a transcript and compares what they print: run_cases.py TRANSCRIPT PROGRAMS WORK_FOLDER

A transcript is a list of commands, which bash runs in order in one empty folder:

  # comment
  == title of the cases that follow
  $ pbm-info missing.pbvg            the command; further lines that start with "> " continue it
  out| expected line                of standard output, in order
  err| expected line                of standard error, in order
  exit 2                            expected exit code; 0 if absent

$ROOT is the source folder. In expected lines <n> stands for a number, <any> for any text, and a line <...> for any number of lines.
Exit code 77 of a command (say "test $UID -ne 0 || exit 77") skips the cases up to the next title.
"""

import difflib
import os
import pathlib
import re
import shutil
import subprocess
import sys

NUMBER = r"[-+]?[0-9][0-9,]*(?:\.[0-9]+)?(?:e[-+]?[0-9]+)?"


class Case:
    def __init__(self, line, title, command):
        self.line, self.title, self.command = line, title, command
        self.expected = {"out": [], "err": []}
        self.exit_code = 0


def read_transcript(path):
    cases, title = [], ""
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        if line.startswith("== "):
            title = line[3:]
        elif line.startswith("$ "):
            cases.append(Case(number, title, line[2:]))
        elif line.startswith("> "):
            cases[-1].command += "\n" + line[2:]
        elif line.startswith("exit "):
            cases[-1].exit_code = int(line[5:])
        elif line[:4] in ("out|", "err|"):
            cases[-1].expected[line[:3]].append(line[4:].removeprefix(" "))
        else:
            sys.exit(f"{path.name}:{number}: what is this? {line}")
    return cases


def pattern_of(lines):
    pattern = ""
    for line in lines:
        if line == "<...>":
            pattern += r"(?:[^\n]*\n)*?"
            continue
        for part in re.split(r"(<n>|<any>)", line):
            pattern += {"<n>": NUMBER, "<any>": r"[^\n]*"}.get(part, re.escape(part))
        pattern += "\n"
    return pattern


def mismatch(kind, expected, actual):
    if actual and not actual.endswith("\n"):
        actual += "\n"
    if re.fullmatch(pattern_of(expected), actual):
        return []
    difference = difflib.ndiff(expected, actual.splitlines())
    return [f"  std{kind} differs (- expected, + printed):"] + ["    " + d for d in difference if d[0] != "?"]


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    transcript, programs, work = map(pathlib.Path, sys.argv[1:])
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    environment = {
        **os.environ,
        "PATH": f"{programs.resolve()}:{os.environ['PATH']}",
        "LC_ALL": "C",
        "PBM_CACHE": str(work.resolve() / "cache"),
        "ROOT": str(pathlib.Path(__file__).resolve().parents[2]),
    }
    failures, passed, skipped, skip_title = [], 0, 0, None
    for case in read_transcript(transcript):
        if case.title == skip_title:
            skipped += 1
            continue
        result = subprocess.run(
            ["bash", "-o", "pipefail", "-c", case.command],
            cwd=work, env=environment, capture_output=True, stdin=subprocess.DEVNULL, timeout=300,
        )
        if result.returncode == 77:
            skip_title = case.title
            skipped += 1
            continue
        problems = []
        for kind, stream in (("out", result.stdout), ("err", result.stderr)):
            problems += mismatch(kind, case.expected[kind], stream.decode(errors="backslashreplace"))
        if result.returncode != case.exit_code:
            problems.insert(0, f"  exit code {result.returncode}, expected {case.exit_code}")
        if problems:
            failures.append("\n".join([f"{transcript.name}:{case.line}: {case.title}: $ {case.command}", *problems]))
        else:
            passed += 1
    print("\n\n".join(failures))
    print(f"{transcript.stem}: {passed} passed, {len(failures)} failed, {skipped} skipped")
    return 1 if failures or passed == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
