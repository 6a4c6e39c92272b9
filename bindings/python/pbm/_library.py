"""libpbm through ctypes: structures and functions of bindings/c/pbm.h, which describes them."""

from __future__ import annotations

import ctypes
import os
from ctypes import (CFUNCTYPE, POINTER, Structure, byref, c_char, c_char_p, c_double, c_float, c_int, c_int32, c_size_t,
                    c_uint8, c_uint32, c_uint64, c_void_p)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

OK, USAGE, IO, INVALID, LIMIT, UNSUPPORTED, CANCELLED = range(7)
NO_OFFSET = 2**64 - 1


class ErrorDetails(Structure):
    _fields_ = [("code", c_int), ("offset", c_uint64), ("name", c_char * 48), ("rule", c_char * 16),
                ("message", c_char * 512)]


class Sized(Structure):
    """A structure that begins with its size."""

    def __init__(self, **members: object) -> None:
        super().__init__(struct_size=ctypes.sizeof(type(self)), **members)


class Info(Sized):
    _fields_ = [("struct_size", c_size_t), ("file_bytes", c_uint64), ("points", c_uint64), ("depth", c_int32),
                ("attributes", c_uint32), ("origin", c_double * 3), ("voxel_size", c_double), ("lowest", c_double * 3),
                ("highest", c_double * 3), ("unit", c_char_p), ("up", c_char_p), ("metadata", c_char_p),
                ("content_id", c_char * 33), ("fields", c_int32), ("materials", c_int32), ("lights", c_int32)]


class Field(Sized):
    _fields_ = [("struct_size", c_size_t), ("name", c_char_p), ("unit", c_char_p), ("lowest", c_double),
                ("step", c_double), ("bits", c_int32), ("average", c_char_p)]


class Points(Sized):
    _fields_ = [("struct_size", c_size_t), ("capacity", c_uint64), ("positions", c_void_p), ("positions_f32", c_void_p),
                ("offset", c_double * 3), ("normals", c_void_p), ("colours", c_void_p), ("radii", c_void_p),
                ("materials", c_void_p), ("two_sided", c_void_p), ("fields", POINTER(c_void_p)),
                ("field_count", c_int32), ("threads", c_int32), ("round", c_void_p)]


class Sides(Sized):
    _fields_ = [("struct_size", c_size_t), ("capacity", c_uint64), ("points", c_void_p), ("normals", c_void_p),
                ("colours", c_void_p), ("materials", c_void_p)]


class Camera(Sized):
    _fields_ = [("struct_size", c_size_t), ("position", c_double * 3), ("focal_point", c_double * 3),
                ("up", c_double * 3), ("view_angle", c_double), ("orthographic", c_int32), ("clip", c_uint32),
                ("plane_point", c_double * 3), ("plane_normal", c_double * 3), ("box_lowest", c_double * 3),
                ("box_highest", c_double * 3), ("backs", c_int32)]


class RenderOptions(Sized):
    _fields_ = [("struct_size", c_size_t), ("quality", c_int32), ("samples", c_int32), ("depth_cue", c_int32),
                ("flags", c_uint32), ("background", c_uint8 * 4), ("finest_level", c_int32), ("max_error", c_double),
                ("threads", c_int32), ("max_memory", c_uint64), ("light_follows", c_int32),
                ("colour_range", c_double * 2), ("headlight", c_double * 2), ("colour_by", c_char_p),
                ("colour_map", c_int32), ("drop_class", c_char_p), ("show_class", c_char_p), ("shading", c_int32),
                ("background_below", c_uint8 * 4)]


class Picture(Sized):
    _fields_ = [("struct_size", c_size_t), ("width", c_int32), ("height", c_int32), ("pixels", c_void_p),
                ("pixel_bytes", c_size_t), ("stride", c_size_t), ("depths", c_void_p), ("depth_count", c_size_t),
                ("depth_stride", c_size_t)]


class Finding(Structure):
    _fields_ = [("severity", c_int32), ("code", c_int), ("offset", c_uint64), ("name", c_char_p), ("rule", c_char_p),
                ("section", c_char_p), ("message", c_char_p), ("remedy", c_char_p)]


ReportFinding = CFUNCTYPE(c_int, c_void_p, POINTER(Finding))
ReportProgress = CFUNCTYPE(c_int, c_void_p, c_char_p, c_double)
ReadRange = CFUNCTYPE(c_int, c_void_p, c_uint64, c_uint64, c_void_p)


class Validation(Sized):
    _fields_ = [("struct_size", c_size_t), ("level", c_int32), ("threads", c_int32), ("max_findings", c_uint64),
                ("report", ReportFinding), ("context", c_void_p), ("verdict", c_int), ("errors", c_uint64),
                ("warnings", c_uint64), ("infos", c_uint64), ("points", c_uint64)]


class Arrays(Sized):
    _fields_ = [("struct_size", c_size_t), ("vertex_count", c_uint64), ("positions", c_void_p),
                ("positions_f32", c_void_p), ("normals", c_void_p), ("colours", c_void_p), ("radii", c_void_p),
                ("materials", c_void_p), ("face_count", c_uint64), ("faces", c_void_p), ("field_count", c_int32),
                ("field_names", POINTER(c_char_p)), ("field_units", POINTER(c_char_p)),
                ("field_values", POINTER(c_void_p))]


_error = POINTER(ErrorDetails)
_ARGUMENTS: dict[str, list[object]] = {
    "pbm_open_file": [c_char_p, POINTER(c_void_p), _error],
    "pbm_open_private": [c_char_p, POINTER(c_void_p), _error],
    "pbm_open_memory": [c_void_p, c_uint64, POINTER(c_void_p), _error],
    "pbm_open_ranges": [ReadRange, c_void_p, c_uint64, POINTER(c_void_p), _error],
    "pbm_close": [c_void_p],
    "pbm_get_info": [c_void_p, POINTER(Info), _error],
    "pbm_get_field": [c_void_p, c_int32, POINTER(Field), _error],
    "pbm_count_points": [c_void_p, c_int32, POINTER(c_uint64), _error],
    "pbm_read_points": [c_void_p, c_int32, POINTER(Points), POINTER(c_uint64), _error],
    "pbm_count_sides": [c_void_p, c_int32, POINTER(c_uint64), _error],
    "pbm_read_sides": [c_void_p, c_int32, POINTER(Sides), POINTER(c_uint64), _error],
    "pbm_default_camera": [c_void_p, c_int32, c_int32, POINTER(Camera), _error],
    "pbm_render": [c_void_p, POINTER(Camera), POINTER(RenderOptions), POINTER(Picture), _error],
    "pbm_validate_file": [c_char_p, POINTER(Validation), _error],
    "pbm_validate_memory": [c_void_p, c_uint64, POINTER(Validation), _error],
    "pbm_new_builder": [POINTER(c_void_p), _error],
    "pbm_free_builder": [c_void_p],
    "pbm_set_option": [c_void_p, c_char_p, c_char_p, _error],
    "pbm_set_progress": [c_void_p, ReportProgress, c_void_p, _error],
    "pbm_add_file": [c_void_p, c_char_p, _error],
    "pbm_add_arrays": [c_void_p, POINTER(Arrays), _error],
    "pbm_build": [c_void_p, c_char_p, POINTER(c_void_p), _error],
    "pbm_cancel_build": [c_void_p],
    "pbm_get_report": [c_void_p, POINTER(c_char_p), _error],
}

_loaded: ctypes.CDLL | None = None


def library() -> ctypes.CDLL:
    """Loads libpbm on first use: $PBM_LIBRARY, else that of the wheel, else that of the system."""
    global _loaded
    if _loaded is None:
        own = os.path.join(os.path.dirname(os.path.abspath(__file__)), "libs", "libpbm.so.1")
        name = os.environ.get("PBM_LIBRARY") or (own if os.path.exists(own) else "libpbm.so.1")
        try:
            loaded = ctypes.CDLL(name)
        except OSError as error:
            raise OSError(f"{error}: PBM_LIBRARY names the library, or the package libpbm1 installs it") from None
        for function, arguments in _ARGUMENTS.items():
            getattr(loaded, function).argtypes = arguments
        loaded.pbm_version.restype = c_char_p
        _loaded = loaded
    return _loaded


def text(words: str | bytes | os.PathLike[str]) -> bytes:
    """A name or an option as C reads it, to its first zero byte: it must have none."""
    encoded = os.fsencode(words)
    if b"\0" in encoded:
        from .errors import UsageError
        raise UsageError(f"{words!r} holds a zero byte")
    return encoded


def call(function: str, *arguments: object, files: Sequence[str] = ()) -> None:
    """Calls a function of the API, whose last parameter takes the error; raises it. `files`: as error_of."""
    details = ErrorDetails()
    if getattr(library(), function)(*arguments, byref(details)) != OK:
        from .errors import error_of
        raise error_of(details, files)
