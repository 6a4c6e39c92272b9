"""Exceptions of every function."""

from __future__ import annotations

from . import _library


class Error(Exception):
    """What went wrong.

    code    exit code of the programs (docs/reference/exit-codes.md), 1 .. 5; 6: cancelled
    offset  byte of the file, or None
    name    of the fault in docs/reference/validator-codes.md, "octree.empty_mask", or ""
    rule    of BVG.md, "4.2", or ""
    """

    code: int = 0

    def __init__(self, message: str, offset: int | None = None, name: str = "", rule: str = "") -> None:
        super().__init__(message)
        self.offset = offset
        self.name = name
        self.rule = rule


class UsageError(Error, ValueError):
    """The call is wrong."""
    code = _library.USAGE


class FileError(Error, OSError):
    """The system did not read or write a file."""
    code = _library.IO


class InvalidError(Error, ValueError):
    """Invalid or damaged input."""
    code = _library.INVALID


class LimitError(Error, MemoryError):
    """Memory, or another limit of the running program."""
    code = _library.LIMIT


class UnsupportedError(Error):
    """A version or feature that this library does not know."""
    code = _library.UNSUPPORTED


class CancelledError(Error):
    """A callback asked for it."""
    code = _library.CANCELLED


_CLASSES = {kind.code: kind for kind in (UsageError, FileError, InvalidError, LimitError, UnsupportedError, CancelledError)}


def error_of(details: _library.ErrorDetails) -> Error:
    text = [value.decode("utf-8", "replace") for value in (details.message, details.name, details.rule)]
    offset = None if details.offset == _library.NO_OFFSET else details.offset
    return _CLASSES[details.code](text[0], offset, text[1], text[2])
