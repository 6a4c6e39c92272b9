"""Exceptions of every function."""

from __future__ import annotations

import errno
import os

from . import _library

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence


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

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (str(self), self.offset, self.name, self.rule)


class UsageError(Error, ValueError):
    """The call is wrong."""
    code = _library.USAGE


def _errno_of(message: str) -> int:
    """The system's number of an error whose message ends with the system's text."""
    for number in errno.errorcode:
        if message.endswith(": " + os.strerror(number)):
            return number
    return errno.EISDIR if message.endswith("this is a folder") else errno.EIO


class FileError(Error, OSError):
    """The system did not read or write a file.

    errno, strerror  the system's number and text; EIO where the system gave none, as of a file that became shorter
    filename         as the caller gave it, or None: another file, such as one that a scan names
    """
    code = _library.IO

    def __init__(self, message: str, offset: int | None = None, name: str = "", rule: str = "",
                 filename: str | None = None) -> None:
        super().__init__(message, offset, name, rule)
        self.errno = _errno_of(message)
        self.strerror = os.strerror(self.errno)
        self.filename = filename

    def __str__(self) -> str:
        return str(self.args[0])

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (str(self), self.offset, self.name, self.rule, self.filename)


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


_KINDS: tuple[type[Error], ...] = (UsageError, InvalidError, LimitError, UnsupportedError, CancelledError)
_CLASSES = {kind.code: kind for kind in _KINDS}


def error_of(details: _library.ErrorDetails, files: Sequence[str]) -> Error:
    """`files`: those that the caller named, of which the message may begin with one."""
    message, name, rule = (value.decode("utf-8", "replace") for value in (details.message, details.name, details.rule))
    offset = None if details.offset == _library.NO_OFFSET else details.offset
    if details.code != _library.IO:
        return _CLASSES[details.code](message, offset, name, rule)
    named = [file for file in files if details.message.startswith(os.fsencode(file) + b": ")]
    return FileError(message, offset, name, rule, max(named, key=len) if named else None)
