#!/usr/bin/env python3
"""What pbm-render can, C, Python, JavaScript and the element <pbm-viewer> can, or this page says why not. Pictures of the
Python package have the pixels of pbm-render's.

  check_options.py SOURCE_FOLDER PBM_RENDER
"""

import pathlib
import re
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from commands import check, must  # noqa: E402

SKIPPED = 77
try:
    import numpy as np
except ImportError:
    print("numpy is not installed (python3-numpy): skipped")
    sys.exit(SKIPPED)
import pbm

SIZE = (320, 240)

# Options that no binding has, and why.
OF_NO_BINDING = {
    "output": "a program of its own writes the pixels that it gets",
    "depth-output": "depths are an array of the picture",
    "page": "the element shows a model on any page",
    "page-lang": "the same, in the language of the page",
    "page-url": "the same",
    "thumbnail": "a preset of other options",
    "bench": "the caller has a clock",
    "camera-file": "the caller gives the camera",
    "view": "the same; the metadata has the views",
    "resume": "as turntable",
    "preset": "a set of other options",
    "drop-shadow": "the caller has the pixels, and their opacity",
    "scale-bar": "the caller has the camera and the unit",
    "dpi": "of files of pictures",
    "exposure": "the caller has the pixels; the element has an attribute of this name",
    "tone": "the same",
    "up": "the caller gives the up vector of a camera",
    "renderer": "the reference renderer needs whole levels, and is there to compare with",
    "splats": "of the reference renderer",
    "turntable": "a loop over cameras; Python: Camera.orbited",
    "avi": "as turntable",
    "frames": "as turntable",
    "fps": "as turntable",
    "video-quality": "as turntable",
    "quiet": "the library prints nothing",
    "verbose": "the library prints nothing",
    "cache": "the bindings build models only when they are told to",
    "recipe": "an option of building: pbm_set_option",
    "json": "the caller has what it asked for",
    "version": "pbm_version",
    "log": "errors are values",
    "help": "pbm.h, docstrings and declarations",
}
# Options of pbm-render: what the members are called in C, JavaScript and the element (None: it lacks them), and a value
# with the arguments of Model.render that draw the same.
SAME = {
    "resolution": ("width", "width", None, None, {}),
    "camera-position": ("position", "position", "camera-orbit", None, {}),
    "camera-focal-point": ("focal_point", "focalPoint", "camera-target", None, {}),
    "camera-view-up": ("up", "up", "camera-orbit", None, {}),
    "camera-view-angle": ("view_angle", "viewAngle", "field-of-view", None, {}),
    "projection": ("orthographic", "orthographic", None, "--projection=orthographic", {"orthographic": True}),
    "clip-plane": ("clip", "clipPlane", None, "--clip-plane=0,0,0,1,0,0", {"clip_plane": ((0, 0, 0), (1, 0, 0))}),
    "clip-box": ("clip", "clipBox", None, "--clip-box=-9,-9,-9,0,9,9", {"clip_box": ((-9, -9, -9), (0, 9, 9))}),
    "quality": ("quality", "quality", "quality", "--quality=fine", {"quality": "fine"}),
    "samples": ("samples", "samples", None, "--quality=fine --samples=3", {"quality": "fine", "samples": 3}),
    "level": ("finest_level", "finestLevel", None, "--level=2", {"finest_level": 2}),
    "max-error": ("max_error", "maxError", None, "--max-error=40", {"max_error": 40}),
    "colour-by": ("colour_by", "colourBy", "colour-by", "--colour-by=height,-1,0.5,grey",
                  {"colour_by": "height", "colour_range": (-1, 0.5), "colour_map": "grey"}),
    "drop-class": ("drop_class", "dropClass", "drop-class", "--drop-class=2,noise", {"drop_class": "2,noise"}),
    "show-class": ("show_class", "showClass", "show-class", "--show-class=ground", {"show_class": "ground"}),
    "no-background": ("PBM_BACKGROUND", "background", "background", "--no-background",
                      {"background": (0, 0, 0, 0), "without": ["panorama"]}),
    "backs": ("backs", "backs", "backs", "--backs=hide", {"backs": "hide"}),
    "texture": ("PBM_NO_TEXTURE", "without", None, "--no-texture", {"without": ["texture"]}),
    "ignore-point-colours": ("PBM_NO_COLOURS", "without", None, "--no-texture --ignore-point-colours",
                             {"without": ["texture", "colours"]}),
    "panorama": ("PBM_NO_PANORAMA", "without", None, "--no-panorama", {"without": ["panorama"]}),
    "ground": ("PBM_NO_GROUND", "without", None, "--no-ground", {"without": ["ground"]}),
    "reflections": ("PBM_NO_REFLECTIONS", "without", None, "--no-reflections", {"without": ["reflections"]}),
    "depth-cue": ("depth_cue", "depthCue", None, "--depth-cue=eye-dome", {"depth_cue": "eye_dome"}),
    "legend": ("PBM_NO_LEGEND", "without", "no-legend", "--colour-by=classification --no-legend",
               {"colour_by": "classification", "without": ["legend"]}),
    "background-color": ("background", "background", "background", "--no-panorama --background-color=1,0,0.2",
                         {"background": (255, 0, 51), "without": ["panorama"]}),
    "shadows": ("PBM_NO_SHADOWS", "without", None, "--no-shadows", {"without": ["shadows"]}),
    "shading": ("shading", "shading", "shading", "--shading=unlit", {"shading": "unlit"}),
    "light-follows": ("light_follows", "lightFollows", "light-follows", "--light-follows=eye", {"light_follows": "eye"}),
    "headlight": ("headlight", "headlight", "headlight", "--headlight=-45,22.5", {"headlight": (-45, 22.5)}),
    "max-memory": ("max_memory", "maxMemory", "max-memory", None, {}),
    "threads": ("threads", "threads", None, "--threads=1", {"threads": 1}),
}
MORE = [  # with legends
    ("--colour-by=Intensity", {"colour_by": "Intensity"}),
    ("--colour-by=classification --quality=fine", {"colour_by": "classification", "quality": "fine"}),
    ("--colour-by=height,viridis --headlight=0,0 --depth-cue=ambient-occlusion",
     {"colour_by": "height", "colour_map": "viridis", "headlight": (0, 0), "depth_cue": "ambient_occlusion"}),
]


def check_names(source):
    page = (source / "docs/reference/pbm-render.md").read_text()
    options = [re.findall(r"--([a-z-]+)", line) for line in re.findall(r"^ {2,6}(?=-)(.*?)(?:  |\[=| [A-Z]|$)", page, re.MULTILINE)]
    firsts = {names[0] for names in options if names}
    check(len(firsts) > 40, f"pbm-render.md lists {firsts}")
    check(firsts == set(SAME) | set(OF_NO_BINDING),
          f"options of pbm-render that this test does not know, or that are gone: {firsts ^ (set(SAME) | set(OF_NO_BINDING))}")
    header, declared, element = ((source / "bindings" / name).read_text() for name in (
        "c/pbm.h", "web/module/pbm.d.ts", "web/viewer/pbm-viewer.js"))
    observed = re.search(r"observedAttributes = \(\s*\"(.*?)\"", element)[1].split() + ["max-memory"]
    for option, (member, property_, attribute, _, _) in SAME.items():
        check(re.search(rf"\b{member}\b", header), f"--{option}: pbm.h has no {member}")
        check(re.search(rf"\b{property_}\b", declared), f"--{option}: pbm.d.ts has no {property_}")
        check(attribute is None or attribute in observed, f"--{option}: the element has no {attribute}")


def pixels_of(path):
    """A BMP with 24 bits, or with 32 where pixels are transparent: rows padded to 4 bytes."""
    data = path.read_bytes()
    width, height = (int.from_bytes(data[at:at + 4], "little", signed=True) for at in (18, 22))
    channels, start = int.from_bytes(data[28:30], "little") // 8, int.from_bytes(data[10:14], "little")
    stride = (channels * width + 3) // 4 * 4
    rows = np.frombuffer(data, np.uint8, stride * abs(height), start).reshape(abs(height), stride)
    bgr = rows[::1 if height < 0 else -1, :channels * width].reshape(abs(height), width, channels)
    opaque = np.full((abs(height), width, 1), 255, np.uint8)
    return np.concatenate([bgr[..., 2::-1], bgr[..., 3:] if channels == 4 else opaque], axis=2)


def check_pictures(source, render):
    everything, fields = (source / f"format_spec/golden/{name}.pbvg" for name in ("1.0/scan-everything", "1.1/scan-fields"))
    of_camera = {"orthographic", "clip_plane", "clip_box", "backs"}
    with tempfile.TemporaryDirectory() as folder:
        picture = pathlib.Path(folder) / "picture.bmp"
        for words, arguments in [entry[3:] for entry in SAME.values() if entry[3]] + MORE:
            path = fields if {"colour_by", "drop_class", "show_class"} & set(arguments) else everything
            quality = [] if "--quality" in words else ["--quality=fast"]
            with pbm.open(path) as model:
                camera = model.default_camera(SIZE)
                numbers = {"position": camera.position, "focal-point": camera.focal_point, "view-up": camera.up}
                must(render, "-q", path, "-o", picture, "--resolution={},{}".format(*SIZE), *quality, *words.split(),
                     *(f"--camera-{name}=" + ",".join(map(repr, map(float, values))) for name, values in numbers.items()))
                for name in of_camera & set(arguments):
                    setattr(camera, name, arguments[name])
                drawn = model.render(camera, SIZE, **{name: value for name, value in arguments.items() if name not in of_camera})
                usual = model.render(None, SIZE)
            check((drawn == pixels_of(picture)).all(), f"the picture of {arguments} is not that of {words}")
            check(words.startswith("--threads") or (drawn != usual).any(), f"{words} changes nothing")


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    source = pathlib.Path(sys.argv[1])
    check_names(source)
    check_pictures(source, sys.argv[2])


if __name__ == "__main__":
    main()
