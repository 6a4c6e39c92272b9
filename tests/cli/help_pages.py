#!/usr/bin/env python3
"""Help of every program: each topic fits a screen, each option has one topic, and the man page has no fault:
help_pages.py PROGRAMS VERSION"""

import pathlib
import re
import shutil
import subprocess
import sys

LINES, COLUMNS = 24, 80
SECTIONS = ["NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "EXIT STATUS", "EXAMPLES", "SEE ALSO"]
# Pages name the version but no date, so that equal sources give equal pages.
NO_FAULT = "missing date"

folder, version = pathlib.Path(sys.argv[1]), sys.argv[2]
failed = []


def check(condition, message):
    if not condition:
        failed.append(message)


def run(*command):
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=60)
    return result.returncode, result.stdout, result.stderr


def options(page):
    """Names of options that have an entry: "  -o, --output FILE", "      --depth N"."""
    names = []
    for line in page.splitlines():
        if re.match(r"(  |      )-", line):
            names += re.findall(r"(?:^|, )(-{1,2}[A-Za-z][A-Za-z_-]*)", line.strip())
    return names


def check_pages(program):
    def page(*arguments):
        code, text, errors = run(folder / program, *arguments)
        check(code == 0 and not errors, f"{program} {' '.join(arguments)}: {code} {errors}")
        what = f"{program} {' '.join(arguments)}"
        check(all(len(line) < COLUMNS for line in text.splitlines()), f"{what}: wider than {COLUMNS} columns")
        check(arguments == ("--help", "all") or text.count("\n") <= LINES, f"{what}: {text.count(chr(10))} lines")
        return text

    first = page("--help")
    check(page("-h") == first, f"{program}: -h is not --help")
    check(f"Usage: {program} " in first and "Exit codes:" in first, f"{program}: no usage or no exit codes")
    code, _, errors = run(folder / program, "--help", "zzzzzzzz")
    check(code == 1, f"{program} --help zzzzzzzz ends with {code}")
    topics = re.search(r"topics are (.*), all;", errors)[1].split(", ")
    listed = [name for topic in topics for name in options(page("--help", topic))]
    check(len(listed) == len(set(listed)), f"{program}: listed twice: {sorted(listed)}")
    check(sorted(listed) == sorted(options(page("--help", "all"))), f"{program}: --help all lists other options")
    check({"--help", "--version", "--log"} <= set(listed), f"{program}: lacks options that all programs have")
    if "Topics;" in first:
        check(all(f"\n  {topic} " in first for topic in topics), f"{program}: the first page lacks a topic")
    check(run(folder / program, f"--help={topics[0]}")[1] == page("--help", topics[0]), f"{program}: --help=TOPIC")
    return listed


def check_man_page(program, names):
    code, text, _ = run(folder / program, "--help=man")
    check(code == 0, f"{program} --help=man ends with {code}")
    found = re.findall(r"^\.SH (.*)$", text, re.MULTILINE)
    check(found == SECTIONS, f"{program}: man page has {found}")
    check(f'"pbm {version}"' in text, f"{program}: man page is not of version {version}")
    plain = text.replace("\\-", "-")
    check(all(name in plain for name in names), f"{program}: man page lacks an option")
    for command in (["mandoc", "-T", "lint"], ["groff", "-man", "-ww", "-z"]):
        if shutil.which(command[0]):
            result = subprocess.run(command, input=text, capture_output=True, text=True)
            faults = [l for l in (result.stdout + result.stderr).splitlines() if NO_FAULT not in l]
            check(not faults, f"{program}: {command[0]}: {faults}")


programs = sorted(p.name for p in folder.glob("pbm-*") if p.is_file())
for program in programs:
    check(run(folder / program, "--version")[1] == f"{program} {version}\n", f"{program}: another version")
    check_man_page(program, check_pages(program))
print("\n".join(failed + [f"{len(programs)} programs, {len(failed)} faults"]))
sys.exit(1 if failed or not programs else 0)
