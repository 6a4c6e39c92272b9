"""Verdicts on files."""

from __future__ import annotations

import os
from ctypes import byref, c_int32

import numpy as np

from . import _library
from ._library import call, text
from .model import _choice

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .model import Buffer

_LEVELS = {"default": 0, "quick": 1, "deep": 2}
_SEVERITIES = ("info", "warning", "error")


class Finding:
    """A fault, or advice.

    severity  "error", "warning" or "info"; only errors make a file invalid
    name      in docs/reference/validator-codes.md: "octree.empty_mask"
    rule      of BVG.md: "4.2"; "" for advice
    offset    byte of the file
    section   "header", "level 7 chunks", ...
    message, remedy  one line each
    """

    __slots__ = ("severity", "name", "rule", "offset", "section", "message", "remedy")

    def __init__(self, raw: _library.Finding) -> None:
        self.severity: str = _SEVERITIES[raw.severity]
        self.offset: int = raw.offset
        self.name, self.rule, self.section, self.message, self.remedy = (
            text.decode("utf-8", "replace") for text in (raw.name, raw.rule, raw.section, raw.message, raw.remedy))

    def __repr__(self) -> str:
        return f"<{self.severity} {self.name} at byte {self.offset}: {self.message}>"


class Findings(list[Finding]):
    """The findings in the order of the file, a list of Finding, and what was counted.

    valid                    no error was found
    code                     0, or the exit code of the gravest error (docs/reference/exit-codes.md)
    errors, warnings, infos  also those beyond `max_findings`
    points                   verified
    """

    def __init__(self, findings: list[Finding], raw: _library.Validation) -> None:
        super().__init__(findings)
        self.code: int = raw.verdict
        self.valid: bool = raw.verdict == _library.OK
        self.errors: int = raw.errors
        self.warnings: int = raw.warnings
        self.infos: int = raw.infos
        self.points: int = raw.points


def validate(source: str | os.PathLike[str] | Buffer, level: str = "default", *, max_findings: int = 100,
             threads: int = 0) -> Findings:
    """Checks a file, by its name or its bytes, against every rule of BVG.md.

    level  "quick": header and section table; "default": every rule of points, images and tree; "deep": also the
           averages of coarser levels, and advice

    Raises FileError if the file cannot be read, LimitError; a damaged file is no exception.
    """
    findings: list[Finding] = []

    def report(_context: int, finding: Any) -> int:
        findings.append(Finding(finding.contents))
        return 0

    raw = _library.Validation(level=_choice("level", level, _LEVELS), threads=threads, max_findings=max_findings,
                              report=_library.ReportFinding(report))
    if isinstance(source, (str, os.PathLike)):
        call("pbm_validate_file", text(source), byref(raw), files=[os.fspath(source)])
    else:
        array = np.frombuffer(source, np.uint8)
        call("pbm_validate_memory", array.ctypes.data if array.size else byref(c_int32()), array.size, byref(raw))
    return Findings(findings, raw)
