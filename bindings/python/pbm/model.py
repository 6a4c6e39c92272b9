"""Open models: what they hold, their points, pictures of them."""

from __future__ import annotations

import ctypes
import json
import os
from ctypes import byref, c_int32, c_uint64, c_void_p

import numpy as np

from . import _library
from ._library import call, text
from .errors import UsageError

TYPE_CHECKING = False
if TYPE_CHECKING:
    import mmap
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from typing import Any, Union

    import numpy.typing as npt

    Array = np.ndarray[Any, np.dtype[Any]]
    Triple = Union[Sequence[float], Array]
    Buffer = Union[bytes, bytearray, memoryview, mmap.mmap, Array]  # collections.abc.Buffer came with Python 3.12

_ATTRIBUTES = {"colours": 1, "materials": 2, "texture": 4, "shadows": 8, "ground": 16, "panorama": 32, "closed": 64,
               "round_points": 128, "sides": 256, "offsets": 512}
_QUALITIES = {"fast": 0, "fine": 1}
_DEPTH_CUES = {None: 0, "eye_dome": 1, "ambient_occlusion": 2, "none": 3}
_LIGHT_FOLLOWS = {None: 0, "eye": 1, "model": 2}
_SHADINGS = {"auto": 0, "lit": 1, "unlit": 2}
_COLOUR_MAPS = {None: 0, "viridis": 1, "grey": 2, "classes": 3}
_BACKGROUND, _HEADLIGHT, _GRADIENT = 1, 128, 512
_LEFT_OUT = {"texture": 2, "colours": 4, "shadows": 8, "ground": 16, "panorama": 32, "reflections": 64, "legend": 256}


class Field:
    """A scalar field: a measurement of the points, such as their intensity or class.

    name, unit  as the scan had them; the unit may be ""
    lowest      value of the lowest stored number
    step        between the values of two stored numbers
    bits        of a stored number: 8 or 16
    average     how coarser levels get theirs: "mean", "majority" or "max"
    """

    __slots__ = ("name", "unit", "lowest", "step", "bits", "average")

    def __init__(self, name: str, unit: str, lowest: float, step: float, bits: int, average: str) -> None:
        self.name, self.unit, self.lowest, self.step, self.bits, self.average = name, unit, lowest, step, bits, average

    def __repr__(self) -> str:
        return f"Field({self.name!r}, {self.unit!r}, lowest={self.lowest}, step={self.step}, bits={self.bits})"


class Info:
    """What a file says of its model. Lengths are model units, whose name is `unit`.

    points, depth      of the finest level, and its number; levels are 0, a single point, .. depth
    file_bytes         size of the file
    origin             [3] minimum corner of the grid
    voxel_size         edge of a finest voxel; 2^(depth - L) times as much at level L
    lowest, highest    [3] corners of a box around the points, at most 1/64 of the grid's edge too large on each side
    unit, up           "m", "mm", "cm", "in", "ft", "km" or "unknown"; "+x", "+y" or "+z"
    metadata           dict of the file's JSON object
    content_id         128 bits, hexadecimal: models with the same one hold the same points and scene
    attributes         frozenset of "colours", "materials", "texture", "shadows", "ground", "panorama";
                       "closed": the surface bounds volumes, so that from outside no back of a point is visible;
                       "round_points": some points lie on no surface;
                       "sides": some points stand for both sides of a thin wall, Model.sides
    materials, lights  their numbers
    fields             tuple of Field
    """

    __slots__ = ("points", "depth", "file_bytes", "origin", "voxel_size", "lowest", "highest", "unit", "up", "metadata",
                 "content_id", "attributes", "materials", "lights", "fields")

    def __init__(self, raw: _library.Info, fields: tuple[Field, ...]) -> None:
        self.points: int = raw.points
        self.depth: int = raw.depth
        self.file_bytes: int = raw.file_bytes
        self.origin = np.array(raw.origin)
        self.voxel_size: float = raw.voxel_size
        self.lowest = np.array(raw.lowest)
        self.highest = np.array(raw.highest)
        self.unit: str = raw.unit.decode()
        self.up: str = raw.up.decode()
        self.metadata: dict[str, Any] = json.loads(raw.metadata.decode("utf-8", "replace"))
        self.content_id: str = raw.content_id.decode()
        self.attributes = frozenset(name for name, bit in _ATTRIBUTES.items() if raw.attributes & bit)
        self.materials: int = raw.materials
        self.lights: int = raw.lights
        self.fields = fields

    def __repr__(self) -> str:
        return f"Info(points={self.points}, depth={self.depth}, voxel_size={self.voxel_size}, unit={self.unit!r})"


_BACKS = ("auto", "show", "hide")
_CLIP_PLANE, _CLIP_BOX = 1, 2
_MAX_EDGE = 32768


class Camera:
    """A pinhole camera, or an orthographic one that sees as much of the focal point's plane.

    position, focal_point  [3] model units; the focal point is in the middle of the picture
    up                     [3] of any length, not along the line of sight
    view_angle             vertical, degrees, above 0 and below 180
    clip_plane             (point [3], normal [3]): what lies on the normal's side is kept
    clip_box               (lowest [3], highest [3]): what lies inside is kept
    backs                  whether points that face away are drawn: "show", "hide", or "auto": unless the file says that
                           its surface is closed
    """

    __slots__ = ("position", "focal_point", "up", "view_angle", "orthographic", "clip_plane", "clip_box", "backs")

    def __init__(self, position: Triple, focal_point: Triple, up: Triple = (0, 1, 0),
                 view_angle: float = 30, orthographic: bool = False,
                 clip_plane: tuple[Triple, Triple] | None = None, clip_box: tuple[Triple, Triple] | None = None,
                 backs: str = "auto") -> None:
        self.position = np.array(position, float)
        self.focal_point = np.array(focal_point, float)
        self.up = np.array(up, float)
        self.view_angle = view_angle
        self.orthographic = orthographic
        self.clip_plane = clip_plane
        self.clip_box = clip_box
        self.backs = backs

    def orbited(self, degrees: float) -> Camera:
        """The camera after a turn about the axis through the focal point along `up`, counter-clockwise from above."""
        axis = self.up / np.linalg.norm(self.up)
        offset, angle = self.position - self.focal_point, np.radians(degrees)
        along = axis * (axis @ offset)
        turned = along + np.cos(angle) * (offset - along) + np.sin(angle) * np.cross(axis, offset)
        return Camera(self.focal_point + turned, self.focal_point, self.up, self.view_angle, self.orthographic,
                      self.clip_plane, self.clip_box, self.backs)

    def __repr__(self) -> str:
        return f"Camera({self.position.tolist()}, {self.focal_point.tolist()}, {self.up.tolist()}, {self.view_angle})"

    def _raw(self) -> _library.Camera:
        if self.backs not in _BACKS:
            raise UsageError(f"backs of the camera is {self.backs!r}, not one of {', '.join(_BACKS)}")
        raw = _library.Camera(view_angle=np.radians(self.view_angle), orthographic=int(self.orthographic),
                              backs=_BACKS.index(self.backs))
        triples: list[tuple[str, Triple]] = [("position", self.position), ("focal_point", self.focal_point),
                                             ("up", self.up)]
        if self.clip_plane is not None:
            raw.clip |= _CLIP_PLANE
            triples += zip(("plane_point", "plane_normal"), self.clip_plane)
        if self.clip_box is not None:
            raw.clip |= _CLIP_BOX
            triples += zip(("box_lowest", "box_highest"), self.clip_box)
        for name, values in triples:
            values = np.asarray(values, float)
            if values.shape != (3,):
                raise UsageError(f"{name} of the camera has the shape {values.shape}, not (3,)")
            getattr(raw, name)[:] = values.tolist()
        return raw


class Model:
    """An open model. Close it, or use it as a context manager; `pbm.open` makes it."""

    def __init__(self, handle: c_void_p, keep: object) -> None:
        self._handle: c_void_p | None = handle
        self._keep = keep  # what the library reads from
        self._info: Info | None = None

    def close(self) -> None:
        """Frees the model; waits until calls of other threads with it have ended. Later calls raise UsageError.

        Raises UsageError within the function of `pbm.open_ranges`, whose call needs the model.
        """
        handle, self._handle = self._handle, None
        if handle and _library.library().pbm_close(handle) != _library.OK:
            self._handle = handle
            raise UsageError("the function that reads a model must not close it")
        self._keep = None

    def __reduce__(self) -> tuple[object, ...]:
        raise TypeError("an open model cannot be copied or pickled: open its file again")

    def __enter__(self) -> Model:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "_handle", None) and _library._loaded is not None:
            self.close()

    def __repr__(self) -> str:
        return f"<pbm.Model {self.info!r}>" if self._handle else "<pbm.Model, closed>"

    @property
    def info(self) -> Info:
        """What the file says of the model; reads the coarse levels for its bounds."""
        if self._info is None:
            raw = _library.Info()
            self._call("pbm_get_info", byref(raw))
            fields = []
            for index in range(raw.fields):
                field = _library.Field()
                self._call("pbm_get_field", index, byref(field))
                fields.append(Field(field.name.decode("utf-8", "replace"), field.unit.decode("utf-8", "replace"),
                                    field.lowest, field.step, field.bits, field.average.decode()))
            self._info = Info(raw, tuple(fields))
        return self._info

    def count_points(self, level: int | None = None) -> int:
        """Points of a level, 0 .. info.depth; None: the finest one. Reads none of them."""
        count = c_uint64()
        self._call("pbm_count_points", self._level(level), byref(count))
        return count.value

    def points(self, level: int | None = None, attributes: Iterable[str] | None = None, *,
               dtype: npt.DTypeLike = np.float64, offset: Triple = (0, 0, 0),
               out: Mapping[str, Array] | None = None, threads: int = 0) -> dict[str, Array]:
        """The points of a level in Morton order, one array an attribute.

        positions   [points][3] float64 or float32, model units: centres of the voxels, less `offset` in float32
        normals     [points][3] float32, unit length
        colours     [points][3] uint8, sRGB
        radii       [points] float32, model units: of the disc that closes the gaps to the neighbours
        materials   [points] uint8, index
        two_sided   [points] bool: the point shows both of its sides
        round       [points] bool: the point lies on no surface; it is drawn as a disc that faces the eye
        scalar_X    [points] float32: the field X; NaN: the point has no value

        level       0 .. info.depth; None: the finest one
        attributes  names of those to read; None: positions, normals, radii, and what the model has of colours,
                    materials and fields
        dtype       of the positions
        out         arrays to fill instead of new ones, C-contiguous, with these shapes and types, by names of those
                    that are read
        threads     0: one per processor

        Raises UsageError, InvalidError for a damaged file, LimitError.
        """
        level = self._level(level)
        count = self.count_points(level)
        names = list(attributes) if attributes is not None else self._default_attributes()
        raw = _library.Points(capacity=count, threads=threads)
        fields = {f"scalar_{field.name}": index for index, field in enumerate(self.info.fields)}
        pointers = (c_void_p * max(len(fields), 1))()
        dtype = np.dtype(dtype)
        if dtype not in (np.dtype(np.float64), np.dtype(np.float32)):
            raise UsageError(f"positions are float64 or float32, not {dtype}")
        for name in out or ():
            if name not in names:
                raise UsageError(f"out has {name!r}, which is not read: {', '.join(names)}")
        result = {}
        for name in names:
            kind, width = self._shape(name, dtype, fields)
            shape = (count, width) if width > 1 else (count,)
            array = np.empty(shape, kind) if out is None or name not in out else out[name]
            if array.shape != shape or array.dtype != kind or not array.flags.c_contiguous or not array.flags.writeable:
                raise UsageError(f"out[{name!r}] has the shape {array.shape} and the type {array.dtype}; it must be a "
                                 f"writable C-contiguous array of shape {shape} and type {np.dtype(kind)}")
            result[name] = array
            if name in fields:
                pointers[fields[name]] = array.ctypes.data
            else:
                setattr(raw, "positions_f32" if name == "positions" and dtype == np.float32 else name,
                        array.ctypes.data)
        raw.offset[:] = [float(x) for x in offset]
        raw.fields = ctypes.cast(pointers, ctypes.POINTER(c_void_p))
        raw.field_count = len(fields)
        self._call("pbm_read_points", level, byref(raw), None)
        return result

    def sides(self, level: int | None = None) -> dict[str, Array]:
        """The points of a level that stand for both sides of a thin wall, and both of these.

        points      [sides] uint64: index in the arrays of `points`, which have the means of both sides
        normals     [sides][2][3] float32, unit length
        colours     [sides][2][3] uint8, sRGB
        materials   [sides][2] uint8, index; where the model has materials

        level       0 .. info.depth; None: the finest one

        Raises UsageError, InvalidError for a damaged file, LimitError.
        """
        level = self._level(level)
        count = c_uint64()
        self._call("pbm_count_sides", level, byref(count))
        shapes: dict[str, tuple[tuple[int, ...], npt.DTypeLike]] = {
            "points": ((), np.uint64), "normals": ((2, 3), np.float32), "colours": ((2, 3), np.uint8)}
        if "materials" in self.info.attributes:
            shapes["materials"] = ((2,), np.uint8)
        result = {name: np.empty((count.value, *shape), kind) for name, (shape, kind) in shapes.items()}
        raw = _library.Sides(capacity=count.value, **{name: array.ctypes.data for name, array in result.items()})
        self._call("pbm_read_sides", level, byref(raw), None)
        return result

    def default_camera(self, size: tuple[int, int] = (1280, 720)) -> Camera:
        """A camera in front of the model that sees all of it in a picture of this size (width, height)."""
        raw = _library.Camera()
        self._call("pbm_default_camera", size[0], size[1], byref(raw))
        return Camera(list(raw.position), list(raw.focal_point), list(raw.up), float(np.degrees(raw.view_angle)))

    def render(self, camera: Camera | None = None, size: tuple[int, int] = (1280, 720), *, quality: str = "fast",
               samples: int = 0, depth_cue: str | None = None, background: Sequence[int] | None = None,
               without: Iterable[str] = (), finest_level: int = 0, max_error: float = 0, depth: bool = False,
               threads: int = 0, light_follows: str | None = None, headlight: tuple[float, float] | None = None,
               colour_by: str | None = None, colour_range: tuple[float, float] | None = None,
               colour_map: str | None = None, drop_class: str | None = None, show_class: str | None = None,
               shading: str = "auto", background_below: Sequence[int] | None = None) -> Array | Any:
        """Draws a picture: [height][width][4] uint8, sRGB with straight alpha, top row first.

        camera        None: default_camera(size)
        size          (width, height) in pixels, each 1 .. 32768
        quality       "fast", or "fine": smoother, about ten times as long
        samples       per pixel of fine pictures, 1 .. 256; 0: 8; where one is enough, one is taken
        depth_cue     "eye_dome" or "ambient_occlusion": shades by depth what has no colours; "none"; None: eye_dome for
                      clouds of points without faces, colours and normals, else none
        background    (red, green, blue[, alpha]), 0 .. 255; None: dark grey
        background_below  at the lower edge, with a gradient from `background` at the upper one; None: no gradient
        without       what to leave out: "texture", "colours", "shadows", "ground", "panorama", "reflections",
                      "legend"
        finest_level  do not draw finer levels than this one; 0: all
        max_error     pixels: largest edge of a drawn voxel that has children; 0: 2, of fine pictures 1.42, and
                      less if they are smaller than 1280x720
        depth         also return depths: [height][width] float32, distance along the view in model units, infinity
                      where nothing is
        light_follows "eye": lights turn with the camera and cast no shadows; "model": they stay where they are; None:
                      those of the file stay, and a file without lights is lit from beside the eye
        headlight     (right, up): one light in place of all others, which follows the camera and comes from so many
                      degrees to the right of the eye, -180 .. 180, and above it, -90 .. 90
        colour_by     points have the colours of its values, and the picture a legend: name of a field, "class" or
                      "return" of a laser; "height", "normal", or "plain", their material. None: their own; "height"
                      where depth_cue=None is eye_dome
        colour_range  (least, most): values with the first and the last colour; None: most values lie between
        colour_map    "viridis", "grey" or "classes", a colour for each label; None: classes for a field of labels, grey
                      for intensities, else viridis
        drop_class    classes of points that are left out: numbers and names of LAS, "noise,ground,31"
        show_class    classes of points that are drawn alone
        shading       "unlit": the colours alone; "lit"; "auto": lit, softly if the points have colours and the file no
                      lights: a surface that faces the eye then keeps its colour

        Raises UsageError for a camera that sees nothing and for a field or class that is not there, InvalidError for a damaged
        file, LimitError.
        """
        if camera is None:
            camera = self.default_camera(size)
        width, height = (int(n) for n in size)
        options = _library.RenderOptions(quality=_choice("quality", quality, _QUALITIES), samples=samples,
                                         depth_cue=_choice("depth_cue", depth_cue, _DEPTH_CUES),
                                         finest_level=finest_level, max_error=max_error, threads=threads,
                                         light_follows=_choice("light_follows", light_follows, _LIGHT_FOLLOWS),
                                         colour_map=_choice("colour_map", colour_map, _COLOUR_MAPS),
                                         shading=_choice("shading", shading, _SHADINGS),
                                         colour_by=None if colour_by is None else colour_by.encode(),
                                         drop_class=None if drop_class is None else drop_class.encode(),
                                         show_class=None if show_class is None else show_class.encode())
        for name in without:
            options.flags |= _choice("without", name, _LEFT_OUT)
        if background is not None:
            options.flags |= _BACKGROUND
            options.background[:] = _opaque(background)
        if background_below is not None:
            options.flags |= _GRADIENT
            options.background_below[:] = _opaque(background_below)
        if headlight is not None:
            options.flags |= _HEADLIGHT
            options.headlight[:] = [float(np.radians(angle)) for angle in headlight]
        if colour_range is not None:
            options.colour_range[:] = [float(end) for end in colour_range]
        if not 1 <= width <= _MAX_EDGE or not 1 <= height <= _MAX_EDGE:
            raise UsageError(f"a picture of {width} x {height} pixels; each is 1 .. {_MAX_EDGE}")
        pixels = np.empty((height, width, 4), np.uint8)
        depths = np.empty((height, width), np.float32) if depth else None
        picture = _library.Picture(width=width, height=height, pixels=pixels.ctypes.data, pixel_bytes=pixels.nbytes)
        if depths is not None:
            picture.depths, picture.depth_count = depths.ctypes.data, depths.size
        self._call("pbm_render", byref(camera._raw()), byref(options), byref(picture))
        return pixels if depths is None else (pixels, depths)

    def _call(self, function: str, *arguments: object) -> None:
        if not self._handle:
            raise UsageError("the model is closed")
        call(function, self._handle, *arguments)

    def _level(self, level: int | None) -> int:
        return self.info.depth if level is None else int(level)

    def _default_attributes(self) -> list[str]:
        has = self.info.attributes
        return (["positions", "normals", "radii"] + [name for name in ("colours", "materials") if name in has] +
                [f"scalar_{field.name}" for field in self.info.fields])

    @staticmethod
    def _shape(name: str, dtype: np.dtype[Any], fields: Mapping[str, int]) -> tuple[npt.DTypeLike, int]:
        shapes: dict[str, tuple[npt.DTypeLike, int]] = {
            "positions": (dtype, 3), "normals": (np.float32, 3), "colours": (np.uint8, 3), "radii": (np.float32, 1),
            "materials": (np.uint8, 1), "two_sided": (np.bool_, 1), "round": (np.bool_, 1)}
        if name in fields:
            return np.float32, 1
        if name not in shapes:
            raise UsageError(f"points have no {name!r} but {', '.join([*shapes, *fields])}")
        return shapes[name]


def _opaque(colour: Sequence[int]) -> list[int]:
    return ([int(c) for c in colour] + [255])[:4]


def _choice(what: str, word: Any, choices: Mapping[Any, int]) -> int:
    if word not in choices:
        raise UsageError(f"{what} is {word!r}, not one of {', '.join(map(repr, choices))}")
    return choices[word]


def open(source: str | os.PathLike[str] | Buffer, *, private: bool = False) -> Model:  # noqa: A001: as gzip.open
    """Opens a model: a file by its name, or the bytes of one, which are not copied and must not change.

    private  read all of a named file into memory now, instead of mapping it. What others do to the file afterwards does
             not matter; if a mapped file becomes shorter, as when another one is copied over it, the system ends the
             process. Costs as much memory as the file is large, and the time to read it

    Raises FileError, InvalidError, UnsupportedError.
    """
    handle = c_void_p()
    if isinstance(source, (str, os.PathLike)):
        call("pbm_open_private" if private else "pbm_open_file", text(source), byref(handle), files=[os.fspath(source)])
        return Model(handle, None)
    array = np.frombuffer(source, np.uint8)
    call("pbm_open_memory", array.ctypes.data if array.size else byref(c_int32()), array.size, byref(handle))
    return Model(handle, array)


def open_ranges(read: Callable[[int, int], Buffer], size: int) -> Model:
    """Opens a file of `size` bytes of which only what a call needs is read, as from a server that answers range requests.

    `read(offset, bytes)` returns that many bytes. What it raises is raised by the call that needs them.
    """
    raised: list[BaseException] = []

    def read_range(_context: int, offset: int, count: int, to: int) -> int:
        try:
            received = np.frombuffer(read(offset, count), np.uint8)
            if received.size != count:
                raise ValueError(f"{received.size} bytes instead of {count}")
            ctypes.memmove(to, received.ctypes.data, count)
            return 0
        except BaseException as error:  # noqa: BLE001: no exception passes through C
            raised.append(error)
            return 1

    callback = _library.ReadRange(read_range)
    handle = c_void_p()
    with _Raising(raised):
        call("pbm_open_ranges", callback, None, size, byref(handle))
    return _RangedModel(handle, callback, raised)


class _Raising:
    """Raises what a callback raised from the error that the library makes of it."""

    def __init__(self, raised: list[BaseException]) -> None:
        self._raised = raised

    def __enter__(self) -> None:
        self._raised.clear()

    def __exit__(self, kind: object, error: BaseException | None, _trace: object) -> None:
        if error is not None and self._raised:
            raise self._raised.pop() from error


class _RangedModel(Model):
    def __init__(self, handle: c_void_p, keep: object, raised: list[BaseException]) -> None:
        super().__init__(handle, keep)
        self._raised = raised

    def _call(self, function: str, *arguments: object) -> None:
        with _Raising(self._raised):
            super()._call(function, *arguments)
