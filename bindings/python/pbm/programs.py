"""The programs of the wheel as commands: each runs the file of its name in bin/."""

import os
import sys


def _run(name: str) -> None:
    program = os.path.join(os.path.dirname(os.path.abspath(__file__)), "bin", name)
    try:
        os.execv(program, [name, *sys.argv[1:]])
    except OSError as error:
        sys.exit(f"{name}: {program}: {error.strerror}; install the wheel of pbm-scan anew")


def build() -> None:
    _run("pbm-build")


def render() -> None:
    _run("pbm-render")


def validate() -> None:
    _run("pbm-validate")


def info() -> None:
    _run("pbm-info")


def export() -> None:
    _run("pbm-export")
