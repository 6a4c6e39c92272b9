"""Building models of files and arrays."""

from __future__ import annotations

import json
import os
import threading
from ctypes import byref, c_char_p, c_void_p

import numpy as np

from . import _library
from ._library import call, text
from .errors import UsageError
from .model import Model, _Raising

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

    import numpy.typing as npt

    from .model import Array


class Report:
    """What became of a scan: `figures` is the JSON of pbm-build --json as a dict, with the fate of each attribute.

    `model` is open, be it in memory or in the output file.
    """

    __slots__ = ("figures", "model")

    def __init__(self, figures: dict[str, Any], model: Model) -> None:
        self.figures, self.model = figures, model

    def __repr__(self) -> str:
        return f"Report(points={self.figures['points']}, depth={self.figures['depth']})"


def _array(name: str, values: object, kind: npt.DTypeLike, shape: tuple[int, ...]) -> Array:
    array = np.asarray(values)
    if array.dtype.kind not in "fiub":
        raise UsageError(f"{name} has the type {array.dtype}, not numbers")
    if array.shape != shape:
        raise UsageError(f"{name} has the shape {array.shape}, not {shape}")
    if np.dtype(kind).kind == "u" and array.size and array.dtype.kind == "f":
        raise UsageError(f"{name} has the type {array.dtype}, not whole numbers")
    if np.dtype(kind).kind == "u" and array.size:
        lowest, highest = int(array.min()), int(array.max())
        if lowest < 0 or highest > np.iinfo(kind).max:
            raise UsageError(f"{name} has values {lowest} .. {highest}, not 0 .. {np.iinfo(kind).max}")
    return np.ascontiguousarray(array, kind)


def _raw_arrays(vertices: object, faces: object, normals: object, colours: object, radii: object, materials: object,
                fields: Mapping[str, object] | None,
                units: Mapping[str, str] | None) -> tuple[_library.Arrays, list[Array]]:
    positions = np.asarray(vertices)
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise UsageError(f"vertices has the shape {positions.shape}, not (vertices, 3)")
    count = positions.shape[0]
    kind = np.float32 if positions.dtype == np.float32 else np.float64
    raw = _library.Arrays(vertex_count=count)
    kept: list[Array] = []

    def give(member: str, name: str, values: object, kind: npt.DTypeLike, shape: tuple[int, ...]) -> None:
        if values is not None:
            kept.append(_array(name, values, kind, shape))
            setattr(raw, member, kept[-1].ctypes.data)

    give("positions_f32" if kind == np.float32 else "positions", "vertices", positions, kind, (count, 3))
    give("normals", "normals", normals, np.float32, (count, 3))
    give("colours", "colours", colours, np.uint8, (count, 3))
    give("radii", "radii", radii, np.float32, (count,))
    give("materials", "materials", materials, np.uint8, (count,))
    corners = np.asarray([] if faces is None else faces)
    if corners.size > 0:
        give("faces", "faces", corners, np.uint32, (*corners.shape[:1], 3))
        raw.face_count = corners.shape[0]
    named = dict(fields or {})
    room = max(len(named), 1)
    names, unit_names, values = (c_char_p * room)(), (c_char_p * room)(), (c_void_p * room)()
    for index, (name, column) in enumerate(named.items()):
        kept.append(_array(f"fields[{name!r}]", column, np.float64, (count,)))
        names[index] = text(name)
        unit_names[index] = text((units or {}).get(name, ""))
        values[index] = kept[-1].ctypes.data
    raw.field_count, raw.field_names, raw.field_units, raw.field_values = len(named), names, unit_names, values
    return raw, kept


def _words(value: Any) -> list[str]:
    """The texts of an option: one for each item of a list, unless they are numbers, which are one text."""
    if hasattr(value, "tolist"):  # numpy's
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        if all(isinstance(item, (int, float)) for item in value):
            return [",".join(map(str, value))]
        return [word for item in value for word in _words(item)]
    if isinstance(value, bool):
        return ["true" if value else "false"]
    return [os.fspath(value) if isinstance(value, os.PathLike) else str(value)]


class _Build:
    """A builder, and what a build with it gives."""

    def __init__(self, progress: Callable[[str, float], object] | None) -> None:
        self._builder = c_void_p()
        self._raised: list[BaseException] = []  # by `progress`
        self._progress = progress
        self._callback = _library.ReportProgress(self._report_progress)

    def _report_progress(self, _context: int, step: bytes, done: float) -> int:
        try:
            return 1 if self._progress and self._progress(step.decode(), done) else 0
        except BaseException as error:  # noqa: BLE001: no exception passes through C
            self._raised.append(error)
            return 1

    def run(self, prepare: Callable[[c_void_p], object], output: bytes | None, files: list[str]) -> Report:
        """`prepare` gives the builder its options and scans; `files` are those that the caller named."""
        handle, text_of_report = c_void_p(), c_char_p()
        call("pbm_new_builder", byref(self._builder))
        try:
            prepare(self._builder)
            if self._progress is not None:
                call("pbm_set_progress", self._builder, self._callback, None)
            with _Raising(self._raised):
                call("pbm_build", self._builder, output, byref(handle), files=files)
            model = Model(handle, None)
            call("pbm_get_report", self._builder, byref(text_of_report))
            return Report(json.loads((text_of_report.value or b"").decode("utf-8", "replace")), model)
        finally:
            _library.library().pbm_free_builder(self._builder)

    def cancel(self) -> None:
        _library.library().pbm_cancel_build(self._builder)


def _interruptible(work: Callable[[], Report], cancel: Callable[[], object]) -> Report:
    """Calls `work` by a thread of its own, since signals are handled by the main thread, and only while it runs Python."""
    if threading.current_thread() is not threading.main_thread():
        return work()
    done: list[Report] = []
    raised: list[BaseException] = []
    ended = threading.Event()

    def run() -> None:
        try:
            done.append(work())
        except BaseException as error:  # noqa: BLE001: raised below
            raised.append(error)
        finally:
            ended.set()

    thread = threading.Thread(target=run, daemon=True)
    try:
        thread.start()
        while not ended.wait(0.05):  # a signal that another thread got does not end the wait
            pass
    except BaseException:  # KeyboardInterrupt, or what another handler of a signal raises
        while thread.ident is not None and not ended.is_set():
            cancel()  # again, since the builder may not have been there
            ended.wait(0.01)
        raise
    if raised:
        raise raised.pop()
    return done.pop()


def build(vertices: object = None, faces: object = None, *, normals: object = None, colours: object = None,
          radii: object = None, materials: object = None, fields: Mapping[str, object] | None = None,
          units: Mapping[str, str] | None = None, files: Any = None,
          output: str | os.PathLike[str] | None = None,
          progress: Callable[[str, float], object] | None = None, **options: object) -> Report:
    """Builds a model of arrays, or of scans in files.

    vertices   [vertices][3] numbers; float32 arrays are taken as they are, others as float64
    faces      [faces][3] whole numbers: vertices, counter-clockwise from outside; None: a cloud of points
    normals    [vertices][3] of any length; 0, 0, 0: none here
    colours    [vertices][3] 0 .. 255, sRGB
    radii      [vertices] of splats, units of the vertices; 0: none here
    materials  [vertices] 0 .. 7: numbers of the option `material`
    fields     name -> [vertices] numbers; NaN: no value
    units      name -> unit of a field
    files      a name, or several, instead of arrays: any format that pbm-build reads
    output     file to write, replaced in one step once the new one is verified; None: the model is in memory alone.
               Both ways it is open as the report's `model`
    progress   called with the name of a step and 0 .. 1; anything true that it returns cancels
    options    those of pbm-build, with _ for -: depth=9, strict=True, light=["studio"], voxel_size=0.5, origin=(0, 0, 5)

    Raises UsageError, FileError, InvalidError, LimitError, UnsupportedError, CancelledError; what `progress` raises.
    In the main thread a signal whose handler raises, such as Ctrl-C, ends the call; an old output stays as it was.
    """
    if (vertices is None) == (files is None):
        raise UsageError("give vertices or files, one of the two")
    names = [] if files is None else [files] if isinstance(files, (str, os.PathLike)) else list(files)
    words = [(key.replace("_", "-"), word)
             for key, value in options.items() if value is not None for word in _words(value)]
    given = []
    if files is None:
        given.append(_raw_arrays(vertices, faces, normals, colours, radii, materials, fields, units))

    def prepare(builder: c_void_p) -> None:
        for key, word in words:
            call("pbm_set_option", builder, text(key), text(word))
        for name in names:
            call("pbm_add_file", builder, text(name))
        while given:  # the library copies arrays: those made here are freed before it builds
            raw, kept = given.pop()
            call("pbm_add_arrays", builder, byref(raw))
            del kept

    outputs = [] if output is None else [output]
    known = [os.fspath(name) for name in [*names, *outputs]] + [word for _, word in words]
    target = None if output is None else text(output)
    running = _Build(progress)
    return _interruptible(lambda: running.run(prepare, target, known), running.cancel)
