"""The programs as commands: each runs the file of its name in bin/ of the wheel, else the one in PATH."""

from __future__ import annotations

import os
import shutil
import sys
from typing import NoReturn

NAMES = ("build", "render", "validate", "info", "export")


def run(name: str, arguments: list[str]) -> NoReturn:
    """Becomes the program pbm-NAME."""
    program = f"pbm-{name}"
    own = os.path.join(os.path.dirname(os.path.abspath(__file__)), "bin", program)
    found = own if os.path.exists(own) else shutil.which(program)
    if found is None:
        sys.exit(f"{program}: not found; install the wheel of pbm-scan, or put {program} into the PATH")
    try:
        os.execv(found, [program, *arguments])
    except OSError as error:
        sys.exit(f"{program}: {found}: {error.strerror}; install the wheel of pbm-scan anew")


def build() -> None:
    run("build", sys.argv[1:])


def render() -> None:
    run("render", sys.argv[1:])


def validate() -> None:
    run("validate", sys.argv[1:])


def info() -> None:
    run("info", sys.argv[1:])


def export() -> None:
    run("export", sys.argv[1:])
