"""Building models of files and arrays."""

from __future__ import annotations

import json
import os
from ctypes import byref, c_char_p, c_void_p

import numpy as np

from . import _library
from ._library import call
from .errors import UsageError
from .model import Model, _Raising

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


class Report:
    """What became of a scan: `figures` is the JSON of pbm-build --json as a dict, with the fate of each attribute.

    `model` is open if there is no output file, else None.
    """

    __slots__ = ("figures", "model")

    def __init__(self, figures: dict, model: Model | None) -> None:
        self.figures, self.model = figures, model

    def __repr__(self) -> str:
        return f"Report(points={self.figures['points']}, depth={self.figures['depth']})"


def _array(name: str, values: object, kind: object, shape: tuple[int, ...]) -> np.ndarray:
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
                fields: Mapping[str, object] | None, units: Mapping[str, str] | None) -> tuple[_library.Arrays, list]:
    positions = np.asarray(vertices)
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise UsageError(f"vertices has the shape {positions.shape}, not (vertices, 3)")
    count = positions.shape[0]
    kind = np.float32 if positions.dtype == np.float32 else np.float64
    raw = _library.Arrays(vertex_count=count)
    kept = []

    def give(member: str, name: str, values: object, kind: object, shape: tuple[int, ...]) -> None:
        if values is not None:
            kept.append(_array(name, values, kind, shape))
            setattr(raw, member, kept[-1].ctypes.data)

    give("positions_f32" if kind == np.float32 else "positions", "vertices", positions, kind, (count, 3))
    give("normals", "normals", normals, np.float32, (count, 3))
    give("colours", "colours", colours, np.uint8, (count, 3))
    give("radii", "radii", radii, np.float32, (count,))
    give("materials", "materials", materials, np.uint8, (count,))
    if faces is not None and len(faces) > 0:
        raw.face_count = len(faces)
        give("faces", "faces", faces, np.uint32, (len(faces), 3))
    named = dict(fields or {})
    names, unit_names, values = ((kind * max(len(named), 1))() for kind in (c_char_p, c_char_p, c_void_p))
    for index, (name, column) in enumerate(named.items()):
        kept.append(_array(f"fields[{name!r}]", column, np.float64, (count,)))
        names[index] = name.encode()
        unit_names[index] = (units or {}).get(name, "").encode()
        values[index] = kept[-1].ctypes.data
    raw.field_count, raw.field_names, raw.field_units, raw.field_values = len(named), names, unit_names, values
    return raw, kept


def _words(value: object) -> list[str]:
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


def build(vertices: object = None, faces: object = None, *, normals: object = None, colours: object = None,
          radii: object = None, materials: object = None, fields: Mapping[str, object] | None = None,
          units: Mapping[str, str] | None = None, files: object = None, output: str | os.PathLike | None = None,
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
    output     file to write, replaced in one step once the new one is verified; None: the model is in memory, and
               open as the report's `model`
    progress   called with the name of a step and 0 .. 1; anything true that it returns cancels
    options    those of pbm-build, with _ for -: depth=9, strict=True, light=["studio"], voxel_size=0.5, origin=(0, 0, 5)

    Raises UsageError, FileError, InvalidError, LimitError, UnsupportedError, CancelledError; what `progress` raises.
    """
    if (vertices is None) == (files is None):
        raise UsageError("give vertices or files, one of the two")
    raised: list[BaseException] = []

    def report_progress(_context: int, step: bytes, done: float) -> int:
        try:
            return 1 if progress(step.decode(), done) else 0
        except BaseException as error:  # noqa: BLE001: no exception passes through C
            raised.append(error)
            return 1

    callback = _library.ReportProgress(report_progress) if progress is not None else _library.ReportProgress()
    builder = c_void_p()
    call("pbm_new_builder", byref(builder))
    try:
        for key, value in options.items():
            if value is None:
                continue
            for word in _words(value):
                call("pbm_set_option", builder, key.replace("_", "-").encode(), os.fsencode(word))
        if files is not None:
            for name in [files] if isinstance(files, (str, os.PathLike)) else files:
                call("pbm_add_file", builder, os.fsencode(name))
        else:
            raw, kept = _raw_arrays(vertices, faces, normals, colours, radii, materials, fields, units)
            call("pbm_add_arrays", builder, byref(raw))
            del kept
        call("pbm_set_progress", builder, callback, None)
        handle = c_void_p()
        with _Raising(raised):
            call("pbm_build", builder, None if output is None else os.fsencode(output),
                 byref(handle) if output is None else None)
        model = Model(handle, None) if output is None else None
        text = c_char_p()
        call("pbm_get_report", builder, byref(text))
        return Report(json.loads(text.value.decode("utf-8", "replace")), model)
    finally:
        _library.library().pbm_free_builder(builder)
