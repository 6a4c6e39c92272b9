"""Point-based models: scans as binary voxel grids (.pbvg).

    import pbm

    report = pbm.build(vertices, faces, depth=9, output="scan.pbvg")
    with pbm.open("scan.pbvg") as model:
        print(model.info.points, model.info.unit)
        points = model.points(level=8)              # dict of numpy arrays: positions, normals, colours ...
        picture = model.render(size=(1280, 720))    # [720][1280][4] uint8
    for finding in pbm.validate("scan.pbvg"):
        print(finding.name, finding.offset, finding.message)

Every function may be called from any thread and releases the interpreter's lock while the library works. Calls with
the same model wait for each other. Errors are subclasses of pbm.Error, with `code`, `offset`, `name` and `rule`.
"""

from __future__ import annotations

from .building import Report, build
from .errors import (CancelledError, Error, FileError, InvalidError, LimitError, UnsupportedError, UsageError)
from .model import Camera, Field, Info, Model, open, open_ranges  # noqa: A004
from .validation import Finding, Findings, validate

__all__ = [
    "Camera", "CancelledError", "Error", "Field", "FileError", "Finding", "Findings", "Info", "InvalidError",
    "LimitError", "Model", "Report", "UnsupportedError", "UsageError", "build", "open", "open_ranges", "validate",
    "version"
]


def version() -> str:
    """The version of the library, "1.0.0"; `pbm.__version__` is the same."""
    from ._library import library
    found: bytes = library().pbm_version()
    return found.decode()


def __getattr__(name: str) -> str:
    if name == "__version__":
        return version()
    raise AttributeError(f"module 'pbm' has no attribute {name!r}")
