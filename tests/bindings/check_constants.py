#!/usr/bin/env python3
"""What pbm.h says, Python and JavaScript repeat: constants, structures, defaults and limits.

  check_constants.py SOURCE_FOLDER
"""

import ast
import ctypes
import importlib.util
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from commands import check  # noqa: E402

# Enumerations of pbm.h with the words of the bindings, in the order of the header. Where Python says None, JavaScript has
# a word of its own: both stand there. Behind them: the table in Python, the table in JavaScript, both `file name`.
WORDS = [
    ({"PBM_HAS_COLOURS": "colours", "PBM_HAS_MATERIALS": "materials", "PBM_HAS_TEXTURE": "texture",
      "PBM_HAS_SHADOWS": "shadows", "PBM_HAS_GROUND": "ground", "PBM_HAS_PANORAMA": "panorama", "PBM_IS_CLOSED": "closed",
      "PBM_HAS_ROUND_POINTS": "round_points", "PBM_HAS_SIDES": "sides",
      "PBM_HAS_OFFSETS": "offsets"},
     "model.py _ATTRIBUTES", "pbm.js ATTRIBUTES"),
    ({"PBM_BACKS_AUTO": "auto", "PBM_BACKS_SHOWN": "show", "PBM_BACKS_HIDDEN": "hide"}, "model.py _BACKS", "pbm.js BACKS"),
    ({"PBM_FAST": "fast", "PBM_FINE": "fine"}, "model.py _QUALITIES", "pbm.js QUALITIES"),
    ({"PBM_NO_CUE": (None, "auto"), "PBM_EYE_DOME": ("eye_dome", "eye-dome"), "PBM_CUE_OFF": ("none", "none"),
      "PBM_AMBIENT_OCCLUSION": ("ambient_occlusion", "ambient-occlusion")}, "model.py _DEPTH_CUES", "pbm.js DEPTH_CUES"),
    ({"PBM_LIGHTS_DEFAULT": (None, "default"), "PBM_LIGHTS_EYE": "eye", "PBM_LIGHTS_MODEL": "model"},
     "model.py _LIGHT_FOLLOWS", "pbm.js LIGHT_FOLLOWS"),
    ({"PBM_SHADING_AUTO": "auto", "PBM_LIT": "lit", "PBM_UNLIT": "unlit"}, "model.py _SHADINGS", "pbm.js SHADINGS"),
    ({"PBM_MAP_AUTO": (None, "auto"), "PBM_MAP_VIRIDIS": "viridis", "PBM_MAP_GREY": "grey", "PBM_MAP_CLASSES": "classes"},
     "model.py _COLOUR_MAPS", "pbm.js COLOUR_MAPS"),
    ({"PBM_NO_TEXTURE": "texture", "PBM_NO_COLOURS": "colours", "PBM_NO_SHADOWS": "shadows", "PBM_NO_GROUND": "ground",
      "PBM_NO_PANORAMA": "panorama", "PBM_NO_REFLECTIONS": "reflections", "PBM_NO_LEGEND": "legend"},
     "model.py _LEFT_OUT", "pbm.js LEAVE_OUT"),
    ({"PBM_VALIDATE": ("default", "full"), "PBM_VALIDATE_QUICK": "quick", "PBM_VALIDATE_DEEP": "deep"},
     "validation.py _LEVELS", "pbm.js LEVELS"),
    ({"PBM_INFO": "info", "PBM_WARNING": "warning", "PBM_ERROR": "error"}, "validation.py _SEVERITIES", "pbm.js SEVERITIES"),
    ({"PBM_OK": "ok", "PBM_USAGE": "usage", "PBM_IO": "io", "PBM_INVALID": "invalid", "PBM_LIMIT": "limit",
      "PBM_UNSUPPORTED": "unsupported", "PBM_CANCELLED": "cancelled", "PBM_PENDING": "pending"}, None, "errors.js CODES"),
]
# Other constants: their names in Python and in JavaScript, or None.
NAMES = {
    "PBM_BACKGROUND": ("model.py _BACKGROUND", "pbm.js USE_BACKGROUND"),
    "PBM_GRADIENT": ("model.py _GRADIENT", "pbm.js GRADIENT"),
    "PBM_HEADLIGHT": ("model.py _HEADLIGHT", "pbm.js USE_HEADLIGHT"),
    "PBM_CLIP_PLANE": ("model.py _CLIP_PLANE", "pbm.js CLIP_PLANE"),
    "PBM_CLIP_BOX": ("model.py _CLIP_BOX", "pbm.js CLIP_BOX"),
    "PBM_LATER": (None, "pbm.js LATER"),
    **{f"PBM_{name}": (f"_library.py {name}", None)
       for name in ("OK", "USAGE", "IO", "INVALID", "LIMIT", "UNSUPPORTED", "CANCELLED")},
}
# Structures: classes of _library.py and names in structures.js.
STRUCTURES = {
    "pbm_error": ("ErrorDetails", "ERROR"), "pbm_info": ("Info", "INFO"), "pbm_field": ("Field", None),
    "pbm_points": ("Points", None), "pbm_sides": ("Sides", None),
    "pbm_camera": ("Camera", "CAMERA"), "pbm_render_options": ("RenderOptions", "OPTIONS"),
    "pbm_picture": ("Picture", "PICTURE"), "pbm_finding": ("Finding", "FINDING"),
    "pbm_validation": ("Validation", "VALIDATION"), "pbm_arrays": ("Arrays", None),
}
PYTHON_TYPES = {
    "size_t": ctypes.c_size_t, "int32_t": ctypes.c_int32, "uint32_t": ctypes.c_uint32, "uint64_t": ctypes.c_uint64,
    "double": ctypes.c_double, "uint8_t": ctypes.c_uint8, "char": ctypes.c_char, "pbm_code": ctypes.c_int,
    "const char *": ctypes.c_char_p,
}
WEB_TYPES = {
    "size_t": "u32", "int32_t": "i32", "uint32_t": "u32", "uint64_t": "u64", "double": "f64", "uint8_t": "u8",
    "char": "text", "pbm_code": "i32",
}
# Words of the declarations for TypeScript: member, words of which table, words that it lacks or has beside them.
UNIONS = [
    ("module/pbm.d.ts", "backs", "BACKS", set()), ("module/pbm.d.ts", "quality", "QUALITIES", set()),
    ("module/pbm.d.ts", "depthCue", "DEPTH_CUES", set()), ("module/pbm.d.ts", "lightFollows", "LIGHT_FOLLOWS", set()),
    ("module/pbm.d.ts", "colourMap", "COLOUR_MAPS", set()), ("module/pbm.d.ts", "without", "LEAVE_OUT", set()),
    ("module/pbm.d.ts", "level", "LEVELS", set()), ("viewer/pbm-viewer.d.ts", "backs", "BACKS", set()),
    ("module/pbm.d.ts", "shading", "SHADINGS", set()), ("viewer/pbm-viewer.d.ts", "shading", "SHADINGS", set()),
    ("viewer/pbm-viewer.d.ts", "lightFollows", "LIGHT_FOLLOWS", {"default"}),
    ("viewer/pbm-viewer.d.ts", "quality", "QUALITIES", {"auto"}),
]
# Defaults and limits: the constant of the library, and every text that repeats it.
NUMBERS = [
    ("runtime/pbm_render/fine/fine_renderer.h", r"kDefaultSamples = (\d+)", [
        ("c/pbm.h", r"per pixel of fine pictures, 1 \.\. \d+; default (\d+)"),
        ("python/pbm/model.py", r"per pixel of fine pictures, 1 \.\. \d+; 0: (\d+)"),
        ("web/module/pbm.d.ts", r"Per pixel of fine pictures, 1 \.\. \d+\. Default: (\d+)"),
        ("web/viewer/view_worker.js", r"const SAMPLES = (\d+);")]),
    ("runtime/pbm_render/fine/fine_renderer.h", r"kMaxSamples = (\d+)", [
        ("c/pbm.h", r"per pixel of fine pictures, 1 \.\. (\d+)"),
        ("python/pbm/model.py", r"per pixel of fine pictures, 1 \.\. (\d+)"),
        ("web/module/pbm.d.ts", r"Per pixel of fine pictures, 1 \.\. (\d+)")]),
    ("runtime/pbm_render/detail/detail_view.h", r"kFastMaxError = ([\d.]+)", [
        ("c/pbm.h", r"default ([\d.]+), of fine pictures"), ("python/pbm/model.py", r"0: ([\d.]+), of fine pictures"),
        ("web/module/pbm.d.ts", r"Default: ([\d.]+), of fine pictures"),
        ("web/viewer/view_worker.js", r"MAX_ERROR = \{ fast: ([\d.]+)")]),
    ("runtime/pbm_render/detail/detail_view.h", r"kFineMaxError = ([\d.]+);", [
        ("c/pbm.h", r"of fine pictures ([\d.]+\d)"), ("python/pbm/model.py", r"of fine pictures ([\d.]+\d)"),
        ("web/module/pbm.d.ts", r"of fine pictures ([\d.]+\d)"),
        ("web/viewer/view_worker.js", r"MAX_ERROR = \{ fast: [\d.]+, fine: ([\d.]+)")]),
    ("runtime/pbm_render/picture/framebuffer.h", r"kMaxPictureEdge = (\d+)", [
        ("c/pbm.h", r"pixels, 1 \.\. (\d+)"), ("python/pbm/model.py", r"each 1 \.\. (\d+)"),
        ("python/pbm/model.py", r"_MAX_EDGE = (\d+)"), ("web/module/pbm.d.ts", r"Pixels, 1 \.\. (\d+)"),
        ("web/module/pbm.js", r"LARGEST_EDGE = (\d+)"), ("web/viewer/pbm-viewer.js", r"LARGEST_EDGE = (\d+)")]),
    ("runtime/pbm_render/camera/camera.h", r"kDefaultViewAngle = [\d.]+; // (\d+) degrees", [
        ("c/pbm.h", r"0: (\d+) degrees"), ("python/pbm/model.py", r"view_angle: float = (\d+)"),
        ("web/module/pbm.d.ts", r"below pi\. Default: (\d+) degrees")]),
    ("system/threads/parallel.h", r"kMaxThreads = (\d+)", [("c/pbm.h", r"one per processor, at most (\d+)")]),
    ("format_spec/pbm_format/checking/validate.h", r"max_findings = (\d+)", [
        ("c/pbm.h", r"max_findings; +// default (\d+)"), ("python/pbm/validation.py", r"max_findings: int = (\d+)"),
        ("web/module/pbm.js", r"maxFindings = (\d+)"), ("web/module/pbm.d.ts", r"maxFindings default: (\d+)")]),
    ("runtime/pbm_render/appearance/appearance.h", r"background\{([\d, ]+)\}", [
        ("c/pbm.h", r"else ([\d, ]+\d)"), ("web/module/pbm.d.ts", r"0 \.\. 255 each\. Default: ([\d, ]+\d)")]),
]


class Sources:
    def __init__(self, folder):
        self.folder = folder
        texts = {path.name: path.read_text() for path in [*folder.glob("bindings/python/pbm/*.py"),
                                                          *folder.glob("bindings/web/module/*.js")]}
        self.python = {name: self.assigned(text) for name, text in texts.items() if name.endswith(".py")}
        self.texts = texts

    @staticmethod
    def assigned(text):
        """Values of literals that a Python module assigns to names."""
        values = {}
        for node in ast.parse(text).body:
            if not isinstance(node, ast.Assign):
                continue
            try:
                value = ast.literal_eval(node.value)
            except ValueError:
                continue
            for target in node.targets:
                if isinstance(target, ast.Tuple):
                    values.update(zip((name.id for name in target.elts), value))
                else:
                    values[target.id] = value
        return values

    def javascript(self, file, name):
        """The literal that a script assigns to a constant."""
        found = re.search(rf"\b{name} = (?:Object\.freeze\()?(\{{.*?\}}|\[.*?\]|[^,;]+)", self.texts[file], re.DOTALL)
        check(found, f"{file} has no {name}")
        text = re.sub(r"(?<=[{,\s])(\"?)([\w-]+)\1:", r'"\2":', found[1])
        return ast.literal_eval(text)

    def table(self, where):
        """The value of `file name`; tuples and lists count from 0."""
        file, name = where.split()
        value = self.python[file].get(name) if file.endswith(".py") else self.javascript(file, name)
        check(value is not None, f"{file} has no {name}")
        return {word: number for number, word in enumerate(value)} if isinstance(value, (tuple, list)) else value

    def constant(self, where):
        file, name = where.split()
        return library(self.folder).__dict__.get(name) if file == "_library.py" else self.table(where)


def constants_of(header):
    """By name, of all enumerations."""
    found = {}
    for body in re.findall(r"^(?:typedef )?enum [^{]*\{(.*?)\}", header, re.DOTALL | re.MULTILINE):
        found.update((name, int(value)) for name, value in re.findall(r"(PBM_\w+) = (\d+)", body))
    return found


def structures_of(header):
    """By name: [(type, name, length or None)]."""
    found = {}
    for body, name in re.findall(r"^typedef struct \w+ \{\n(.*?)\n\} (\w+);", header, re.DOTALL | re.MULTILINE):
        members = found[name] = []
        for declaration in re.sub(r"//.*", "", body).split(";"):
            parts = re.fullmatch(r"\s*((?:const )?\w+ (?:\*const \*|\*)?|const char \*const \*|const double \*const \*)"
                                 r"(\w+(?:\[\d+\])?(?:, \w+(?:\[\d+\])?)*)\s*", declaration)
            if declaration.strip():
                check(parts, f"pbm.h: {declaration} is no member")
                for member in parts[2].split(", "):
                    plain, _, length = member.partition("[")
                    members.append((parts[1].strip(), plain, int(length[:-1]) if length else None))
    return found


def check_words(header, sources):
    constants, known = constants_of(header), set(NAMES)
    for words, python, web in WORDS:
        known |= set(words)
        for side, where in enumerate((python, web)):
            if where is None:
                continue
            expected = {(word[side] if isinstance(word, tuple) else word): constants.get(name)
                        for name, word in words.items()}
            found = {word.lower() if isinstance(word, str) else word: value for word, value in sources.table(where).items()}
            check(found == expected, f"{where} has {found}, pbm.h {expected}")
    for name, places in NAMES.items():
        for where in filter(None, places):
            value = sources.constant(where)
            check(value == constants.get(name), f"{where} is {value}, {name} of pbm.h {constants.get(name)}")
    check(set(constants) == known, f"pbm.h has other constants than this test: {set(constants) ^ known}")
    check(library(sources.folder).NO_OFFSET == 2**64 - 1 and "#define PBM_NO_OFFSET UINT64_MAX" in header, "no offset")


_libraries = {}


def library(folder):
    if folder not in _libraries:
        spec = importlib.util.spec_from_file_location("library", folder / "bindings/python/pbm/_library.py")
        _libraries[folder] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(_libraries[folder])
    return _libraries[folder]


def same_python_type(declared, length, found):
    if length is not None:
        return found is PYTHON_TYPES[declared] * length or found == PYTHON_TYPES[declared] * length
    if declared in PYTHON_TYPES:
        return found is PYTHON_TYPES[declared]
    return ctypes.sizeof(found) == ctypes.sizeof(ctypes.c_void_p)  # arrays and callbacks


def check_structures(header, sources):
    structures = structures_of(header)
    check(set(structures) == set(STRUCTURES), f"pbm.h has other structures: {set(structures) ^ set(STRUCTURES)}")
    for name, (python, web) in STRUCTURES.items():
        declared = structures[name]
        fields = getattr(library(sources.folder), python)._fields_
        check([field[0] for field in fields] == [member for _, member, _ in declared],
              f"{python} of _library.py has other members than {name}")
        for (kind, member, length), field in zip(declared, fields):
            check(same_python_type(kind, length, field[1]), f"{python}.{member} is {field[1]}, {name} has {kind}")
        if web is None:
            continue
        text = re.search(rf"\b{web} = structure\((.*?)\);", sources.texts["structures.js"], re.DOTALL)
        check(text, f"structures.js has no {web}")
        found = [tuple(part.split()) for part in "".join(re.findall(r'"(.*?)"', text[1])).split(",")]
        expected = []
        for kind, member, length in declared:
            camel = re.sub(r"_(\w)", lambda letter: letter[1].upper(), member)
            expected.append((WEB_TYPES.get(kind, "address"), camel, *([str(length)] if length else [])))
        pointers = {member[1] for member in expected if member[0] == "address"}
        found = [("address" if part[1] in pointers and part[0] == "u32" else part[0], *part[1:]) for part in found]
        check(found == expected, f"{web} of structures.js is {found}, {name} of pbm.h {expected}")


def check_declarations(sources):
    for file, member, table, others in UNIONS:
        text = (sources.folder / "bindings/web" / file).read_text()
        found = re.search(rf"\b{member}\??: (?:Array<)?((?:\"[\w-]+\"(?: \| )?)+)", text)
        check(found, f"{file} declares no words of {member}")
        declared, known = set(re.findall(r'"([\w-]+)"', found[1])), set(sources.javascript("pbm.js", table))
        check(declared ^ known == others, f"{file}: {member} may be {declared}, {table} has {known}")


def check_numbers(sources):
    for file, pattern, places in NUMBERS:
        found = re.search(pattern, (sources.folder / file).read_text())
        check(found, f"{file} has no {pattern}")
        for place, repeated in places:
            values = set(re.findall(repeated, (sources.folder / "bindings" / place).read_text()))
            check(values == {found[1]}, f"bindings/{place} says {values or 'nothing'} where {file} has {found[0]}")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sources = Sources(pathlib.Path(sys.argv[1]))
    header = (sources.folder / "bindings/c/pbm.h").read_text()
    check_words(header, sources)
    check_structures(header, sources)
    check_declarations(sources)
    check_numbers(sources)


if __name__ == "__main__":
    main()
