#!/usr/bin/env python3
"""Cameras of glTF files: one picture, sequences, their parts, and damage: camera_files.py PROGRAMS WORK_FOLDER

This script writes the glTF files as Blender 3.4 does: one animation for each node, a key for every frame.
"""

import base64
import copy
import json
import math
import pathlib
import re
import shutil
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from commands import check, must  # noqa: E402

programs, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
must(programs / "pbm-sample", "-q", "--vertices", "20000", "-o", work / "scan.ply")
must(programs / "pbm-build", "-q", "--depth", "7", work / "scan.ply", "-o", work / "scan.pbvg")
must(programs / "pbm-build", "-q", "--depth", "7", "--up", "z", work / "scan.ply", "-o", work / "upright.pbvg")

LENS = {"type": "perspective", "perspective": {"yfov": math.radians(40), "aspectRatio": 1.5, "znear": 0.001, "zfar": 100}}
DRAWN = ["--quality=fast", "--resolution=48,32"]
FPS, FRAMES = 24, 5


def run(*arguments):
    return subprocess.run([programs / "pbm-render", *map(str, arguments)], cwd=work, capture_output=True, text=True, timeout=120)


def good(*arguments):
    result = run(*arguments)
    check(result.returncode == 0, f"{arguments}: {result.returncode} {result.stderr}")
    return result.stdout


def refused(code, words, *arguments):
    result = run(*arguments)
    check(result.returncode == code and result.stderr.count("\n") == 1 and words in result.stderr,
          f"{arguments}: {result.returncode}, not {code} with '{words}': {result.stderr}")


class Scene:
    """A glTF file: nodes, cameras and channels of animations."""

    def __init__(self, nodes, cameras=(LENS,)):
        self.json = {"asset": {"version": "2.0"}, "nodes": nodes, "cameras": list(cameras), "accessors": [],
                     "bufferViews": [], "animations": []}
        self.binary = b""

    def accessor(self, values, form="f"):
        rows = [value if isinstance(value, (tuple, list)) else (value,) for value in values]
        data = b"".join(struct.pack(f"<{len(row)}{form}", *row) for row in rows)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data + bytes(-len(data) % 4)
        self.json["accessors"].append({
            "bufferView": len(self.json["bufferViews"]) - 1, "componentType": {"f": 5126, "h": 5122}[form], "count": len(rows),
            "type": ["", "SCALAR", "", "VEC3", "VEC4"][len(rows[0])], **({"normalized": True} if form == "h" else {})})
        return len(self.json["accessors"]) - 1

    def move(self, target, times, values, interpolation="LINEAR", form="f"):
        self.json["animations"].append({
            "channels": [{"sampler": 0, "target": target}],
            "samplers": [{"input": self.accessor(times), "output": self.accessor(values, form), "interpolation": interpolation}]})
        return self

    def text(self, uri):
        return json.dumps({**self.json, "buffers": [{"byteLength": len(self.binary), **({"uri": uri} if uri else {})}]}).encode()

    def glb(self):
        head = self.text("")
        head += b" " * (-len(head) % 4)
        body = struct.pack("<II", len(head), 0x4E4F534A) + head + struct.pack("<II", len(self.binary), 0x004E4942) + self.binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body

    def save(self, name):
        if name.endswith(".glb"):
            (work / name).write_bytes(self.glb())
        elif name.endswith("data.gltf"):
            (work / name).write_bytes(self.text("data:application/octet-stream;base64," + base64.b64encode(self.binary).decode()))
        else:
            (work / (name + " 1.bin")).write_bytes(self.binary)
            (work / name).write_bytes(self.text(name + "%201.bin"))
        return name


def views(text):
    """The options of each view that -v prints: name -> numbers."""
    found = []
    for line in re.findall(r"^frame \d+: (.*)", text, re.MULTILINE) or re.findall(r"^view: (.*)", text, re.MULTILINE):
        words = dict(re.findall(r"--([a-z-]+)=(\S+)", line))
        found.append({name: [float(number) for number in value.split(",")] if re.match(r"[-\d]", value) else value
                      for name, value in words.items()} | {"line": line})
    return found


def near(found, expected, what):
    check(all(math.isclose(a, b, abs_tol=1e-6) for a, b in zip(found, expected, strict=True)), f"{what}: {found}, not {expected}")


def forward(view):
    ray = [a - b for a, b in zip(view["camera-focal-point"], view["camera-position"])]
    return [x / math.hypot(*ray) for x in ray]


def turned(angle):  # about the y axis, a quaternion
    return (0, math.sin(angle / 2), 0, math.cos(angle / 2))


def check_one_picture():
    camera = {"name": "Shot 1", "camera": 0, "translation": [0, 0.02, 0.4]}
    scene = Scene([camera, {"name": "Rig", "children": [0], "rotation": turned(math.pi / 2), "translation": [0.01, 0, 0]}])
    for name in ("one.glb", "one.gltf", "one data.gltf"):
        scene.save(name)
        view = views(good("scan.pbvg", "--camera-file", name, "-o", "a.png", "-v", *DRAWN))[0]
        near(view["camera-position"], (0.41, 0.02, 0), name)
        near(view["camera-view-up"], (0, 1, 0), name)
        near(view["camera-view-angle"], (40,), name)
        near(forward(view), (-1, 0, 0), name)
        check("clip-plane" not in view, f"{name}: the lens cuts nothing off, and the view has a clip plane")
        good("scan.pbvg", "-o", "b.png", *view["line"].split())
        check((work / "a.png").read_bytes() == (work / "b.png").read_bytes(), f"{name}: another picture than that of its view")
    view = views(good("upright.pbvg", "--camera-file=one.glb,Shot 1", "-o", "a.png", "-v", "--quality=fast"))[0]
    near(view["camera-position"], (0.41, 0, 0.02), "the z axis is up")
    near(view["camera-view-up"], (0, 0, 1), "the z axis is up")
    check(view["resolution"] == [1080, 720], f"the lens has the aspect 1.5, and the picture is {view['resolution']}")
    flat = Scene([{"camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.02, 0, 0.4, 1]}],
                 [{"type": "orthographic", "name": "Plan", "orthographic": {"xmag": 0.2, "ymag": 0.1, "znear": 0.35, "zfar": 9}}])
    view = views(good("scan.pbvg", "--camera-file", flat.save("flat.glb") + ",Plan", "-o", "a.png", "-v", "--quality=fast"))[0]
    distance = math.dist(view["camera-position"], view["camera-focal-point"])
    near([distance * math.tan(math.radians(view["camera-view-angle"][0] / 2))], [0.1], "half the height")
    near(view["clip-plane"], (0.02, 0, 0.05, 0, 0, -1), "the near plane")
    check(view["projection"] == "orthographic" and view["resolution"] == [1440, 720], f"{view}")


def check_interpolation():
    def positions(interpolation, values, times=(0, 1 / 6)):
        scene = Scene([{"camera": 0}]).move({"node": 0, "path": "translation"}, times, values, interpolation)
        text = good("scan.pbvg", "--camera-file", scene.save("keys.glb"), "-o", "k_%d.png", "-v", "--fps=24", *DRAWN)
        check(f"frames 1 to {FRAMES} of {FRAMES}, 24 a second" in text, text)
        return [view["camera-position"] for view in views(text)]

    for i, place in enumerate(positions("LINEAR", [(0, 0, 0.5), (0.4, 0, 0.5)])):
        near(place, (i * 0.1, 0, 0.5), "LINEAR")
    for i, place in enumerate(positions("STEP", [(0, 0, 0.5), (0.4, 0, 0.5)])):
        near(place, (0.4 if i == 4 else 0, 0, 0.5), "STEP")
    cubic = [(9, 9, 9), (0, 0, 0.5), (0.6, 0, 0), (1.2, 0, 0), (0.4, 0, 0.5), (9, 9, 9)]
    for i, place in enumerate(positions("CUBICSPLINE", cubic)):
        t, span = i / 4, 1 / 6
        x = span * (t**3 - 2 * t**2 + t) * 0.6 + (3 * t**2 - 2 * t**3) * 0.4 + span * (t**3 - t**2) * 1.2
        near(place, (x, 0, 0.5), "CUBICSPLINE")
    # A rotation in whole numbers takes the shorter arc, whatever the sign of its quaternions.
    ends = [[round(32767 * x) for x in turned(0)], [round(-32767 * x) for x in turned(math.pi / 2)]]
    scene = Scene([{"camera": 0}]).move({"node": 0, "path": "rotation"}, (0, 1 / 6), ends, form="h")
    found = views(good("scan.pbvg", "--camera-file", scene.save("turn.glb"), "-o", "k_%d.png", "-v", "--fps=24", *DRAWN))
    for i, view in enumerate(found):
        angle = i * math.pi / 8
        check(math.dist(forward(view), (-math.sin(angle), 0, -math.cos(angle))) < 1e-4, f"rotation {i}: {forward(view)}")
    pointer = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/cameras/0/perspective/yfov"}}}
    scene = Scene([{"camera": 0, "translation": [0, 0, 0.5]}]).move(pointer, (0, 1 / 6), [0.4, 0.8])
    found = views(good("scan.pbvg", "--camera-file", scene.save("zoom.glb"), "-o", "k_%d.png", "-v", "--fps=24", *DRAWN))
    for i, view in enumerate(found):
        near([math.radians(view["camera-view-angle"][0])], [0.4 + 0.1 * i], "zoom")


def film():
    """As Blender's: times begin at frame 1, and both the camera and the node above it move."""
    times = [frame / FPS for frame in range(1, FRAMES + 1)]
    scene = Scene([{"name": "Shot 1", "camera": 0, "translation": [0, 0, 0.4]}, {"name": "Rig", "children": [0]}])
    scene.move({"node": 1, "path": "rotation"}, times, [turned(0.3 * i) for i in range(FRAMES)])
    return scene.move({"node": 0, "path": "translation"}, times, [(0, 0, 0.4 - 0.02 * i) for i in range(FRAMES)])


def check_sequences():
    film().save("film.glb")
    for form in ("png", "jpg", "exr"):
        if form == "exr" and run("scan.pbvg", "-o", "try.exr", *DRAWN).returncode == 5:
            continue
        for folder in ("whole", "parts"):
            (work / folder).mkdir(exist_ok=True)
        common = ["scan.pbvg", "--camera-file", "film.glb", "--samples=2", "--resolution=48,32"]
        text = good(*common, "-o", f"whole/f_%03d.{form}", "--json=whole.json", "--threads=1")
        check("frames 1 to 5 of 5, 24 a second, camera Shot 1" in text and "5 drawn, 0 kept" in text, text)
        sequence = json.loads((work / "whole.json").read_text())["sequence"]
        check((sequence["first_frame"], sequence["last_frame"], sequence["drawn"], sequence["fps"]) == (1, 5, 5, 24), f"{sequence}")
        for part in ("4-9", "1-1", "2-3"):
            good(*common, "-o", f"parts/f_%03d.{form}", f"--frames={part}", "--threads=2")
        names = [f"f_{frame:03}.{form}" for frame in range(1, FRAMES + 1)]
        whole = [(work / "whole" / name).read_bytes() for name in names]
        check(len(set(whole)) == FRAMES, f"{form}: frames are the same")
        check(whole == [(work / "parts" / name).read_bytes() for name in names], f"{form}: parts have other bytes")
        (work / "parts" / names[0]).write_bytes(b"kept")
        (work / "parts" / names[1]).write_bytes(b"")
        (work / "parts" / names[3]).unlink()
        text = good(*common, "-o", f"parts/f_%03d.{form}", "--resume")
        check("2 drawn, 3 kept" in text, text)
        check([(work / "parts" / name).read_bytes() for name in names] == [b"kept"] + whole[1:], f"{form}: --resume")
        (work / "whole" / names[1]).unlink()
        (work / "whole" / names[1]).mkdir()
        before = (work / "whole" / names[2]).read_bytes()
        refused(2, "frame 2: ", *common, "-o", f"whole/f_%03d.{form}", "--frames=1-3")
        check((work / "whole" / names[2]).read_bytes() == before, f"{form}: a frame after a failure")


def film_set():
    """A lopsided tetrahedron and three cameras, one of them below another node."""
    plan = {"type": "orthographic", "name": "Plan", "orthographic": {"xmag": 1, "ymag": 0.75, "znear": 0.1, "zfar": 100}}
    scene = Scene([{"name": "Front", "camera": 0, "translation": [0.5, 0.5, 4]},
                   {"camera": 1, "translation": [0.48, 5, 0.56], "rotation": [math.sin(-0.75), 0, 0, math.cos(0.75)]},
                   {"name": "Side", "camera": 0, "translation": [0, 0.25, 3]},
                   {"children": [2], "rotation": turned(1)}], [LENS, plan])
    corners = [(0, 0, 0), (0.25, 1, 0), (1, 0, 0.25), (0, 0, 0), (1, 0, 0.25), (0.5, 0.25, 1), (1, 0, 0.25), (0.25, 1, 0),
               (0.5, 0.25, 1), (0.25, 1, 0), (0, 0, 0), (0.5, 0.25, 1)]
    scene.json["meshes"] = [{"primitives": [{"attributes": {"POSITION": scene.accessor(corners)}}]}]
    scene.json["nodes"].append({"name": "tetrahedron", "mesh": 0})
    scene.json["scenes"] = [{"nodes": [0, 1, 3, 4]}]
    scene.json["scene"] = 0
    del scene.json["animations"]
    return scene.save("set.glb")


def check_views_of_models():
    """Models of glTF files keep the cameras: their pictures are those of --camera-file."""
    name = film_set()
    must(programs / "pbm-build", "-q", "--depth", "7", name, "-o", "set.pbvg", cwd=work)
    must(programs / "pbm-build", "-q", "--depth", "7", "--scale", "2", name, "-o", "large.pbvg", cwd=work)
    said = must(programs / "pbm-info", "set.pbvg", cwd=work)
    check("views       Front, Plan, Side\n" in said and '"parts":["tetrahedron"]' in said, said)
    pictures = set()
    for view in ("Front", "Plan", "Side"):
        good("set.pbvg", f"--camera-file={name},{view}", "-o", "file.png", *DRAWN)
        good("set.pbvg", f"--view={view}", "-o", "view.png", *DRAWN)
        good("large.pbvg", f"--view={view}", "-o", "large.png", *DRAWN)
        picture = (work / "view.png").read_bytes()
        check((work / "file.png").read_bytes() == picture, f"{view}: another picture than that of --camera-file")
        check((work / "large.png").read_bytes() == picture, f"{view}: another picture of the model of twice the size")
        pictures.add(picture)
    check(len(pictures) == 3, "two views show the same")
    refused(1, "no view is named Back; there are: Front, Plan, Side", "set.pbvg", "--view=Back", "-o", "r.png")
    refused(1, "the model has no view with a name", "scan.pbvg", "--view=Front", "-o", "r.png")
    refused(1, "--camera-position", "set.pbvg", "--view=Front", "--camera-position=0,0,1", "-o", "r.png")
    refused(1, "--view", "set.pbvg", "--view=Front", f"--camera-file={name},Front", "-o", "r.png")


def check_refusals():
    out = ["-o", "r_%d.png", *DRAWN]
    refused(1, "'x.obj' is no camera file", "scan.pbvg", "--camera-file=x.obj", *out)
    refused(2, "missing.glb", "scan.pbvg", "--camera-file=missing.glb", *out)
    two = Scene([{"name": "A", "camera": 0}, {"name": "B\x07", "camera": 0}]).save("two.glb")
    refused(1, "two.glb: 2 cameras; write FILE,NAME with one of them: A, B", "scan.pbvg", f"--camera-file={two}", *out)
    refused(1, "no camera is named C; there are: A, B", "scan.pbvg", f"--camera-file={two},C", *out)
    refused(1, "no camera", "scan.pbvg", "--camera-file", Scene([{"name": "A"}]).save("none.glb"), *out)
    refused(1, "--frames begins at 6, and the animation has 5 frames at 24 a second", "scan.pbvg", "--camera-file=film.glb",
            "--frames=6-7", *out)
    refused(1, "a part of it", "scan.pbvg", "--camera-file=film.glb", "--frames=3", *out)
    refused(1, "are no frames", "scan.pbvg", "--camera-file=film.glb", "--frames=3-2", *out)
    refused(1, "are of a sequence", "scan.pbvg", "--camera-file=film.glb", "--resume", "-o", "r.png")
    refused(1, "are of a sequence", "scan.pbvg", "--frames=2-3", "-o", "r_%d.png")
    refused(1, "a turntable has no parts", "scan.pbvg", "--turntable=t.avi", "--frames=2-3")
    refused(1, "--camera-position", "scan.pbvg", "--camera-file=film.glb", "--camera-position=0,0,1", *out)
    refused(1, "%", "scan.pbvg", "--camera-file=film.glb", "-o", "r_%x.png")
    old = json.dumps({"asset": {"version": "1.0"}, "nodes": []}).encode()
    (work / "old.gltf").write_bytes(old)
    refused(5, "not glTF 2", "scan.pbvg", "--camera-file=old.gltf", *out)
    loop = Scene([{"camera": 0, "children": [1]}, {"children": [0]}]).save("loop.glb")
    refused(3, "below itself", "scan.pbvg", f"--camera-file={loop}", *out)
    packed = film()
    packed.json["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": {}}
    refused(5, "compressed", "scan.pbvg", "--camera-file", packed.save("packed.glb"), *out)
    back = Scene([{"camera": 0}]).move({"node": 0, "path": "translation"}, (0, 2, 1), [(0, 0, 1)] * 3).save("back.glb")
    refused(3, "do not ascend", "scan.pbvg", f"--camera-file={back}", *out)
    flat = Scene([{"camera": 0, "scale": [0, 0, 0], "translation": [0, 0, 1]}]).save("nothing.glb")
    refused(3, "sees nothing", "scan.pbvg", f"--camera-file={flat}", "-o", "r.png")
    check(not list(work.glob("r*.png")), "a run that was refused wrote a picture")


def places(value, path=()):
    """The paths of all numbers and texts of a JSON document."""
    if isinstance(value, (dict, list)):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from places(item, path + (key,))
    else:
        yield path


def check_damage():
    whole = film().glb()
    old = b"an old picture"
    (work / "d_1.png").write_bytes(old)
    common = ["scan.pbvg", "-q", "-o", "d_%d.png", "--frames=1-1", *DRAWN]

    def try_one(what):
        result = run(*common, "--camera-file=damaged.glb")
        check(result.returncode in (0, 1, 3, 5), f"{what}: {result.returncode} {result.stderr}")
        check(result.stderr.count("\n") == (result.returncode != 0), f"{what}: {result.stderr}")
        if result.returncode:
            check((work / "d_1.png").read_bytes() == old, f"{what}: the old picture is lost")
        (work / "d_1.png").write_bytes(old)
        return result.returncode

    for size in range(0, len(whole), 97):
        (work / "damaged.glb").write_bytes(whole[:size])
        check(try_one(f"{size} of {len(whole)} bytes") != 0, f"{size} of {len(whole)} bytes are accepted")
    codes = set()
    for path in places(film().json):
        for value in (-1, 10**18, 1e300, "x", None):
            scene = film()
            owner = scene.json
            for key in path[:-1]:
                owner = owner[key]
            if owner[path[-1]] == value:
                continue
            owner[path[-1]] = copy.copy(value)
            scene.save("damaged.glb")
            codes.add(try_one(f"{path} is {value}"))
    check(codes == {0, 3, 5}, f"mutants ended with {codes}")


check_one_picture()
check_interpolation()
check_sequences()
check_views_of_models()
check_refusals()
check_damage()
print("cameras, their sequences and their parts are as they were written")
