"""The files that the pages of docs/ name: small ones, made once, of which a block of commands gets those that it names."""

import json
import math
import pathlib
import shutil
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "odd"))
import make_files  # noqa: E402


def mesh(folder, name, is_measured, rings=48):
    """A ball with a wave, coloured, perhaps with a measurement, as PLY."""
    rows, faces = [], []
    for ring in range(rings + 1):
        for sector in range(2 * rings):
            polar, around = math.pi * ring / rings, math.pi * sector / rings
            radius = 0.1 + 0.01 * math.sin(7 * around) * math.sin(polar)
            at = (radius * math.sin(polar) * math.cos(around), radius * math.cos(polar), radius * math.sin(polar) * math.sin(around))
            rows.append("%f %f %f %d 120 90" % (*at, 100 + ring) + (f" {ring / rings:f}" if is_measured else ""))
    for ring in range(rings):
        for sector in range(2 * rings):
            a, b = ring * 2 * rings + sector, ring * 2 * rings + (sector + 1) % (2 * rings)
            faces.append(f"4 {a} {b} {b + 2 * rings} {a + 2 * rings}")
    properties = [*(f"float {axis}" for axis in "xyz"), *(f"uchar {name}" for name in ("red", "green", "blue"))]
    properties += ["float confidence"] * is_measured
    (folder / name).write_text(
        f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\n" + "".join(f"property {each}\n" for each in properties) +
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n" + "\n".join(rows + faces) + "\n")


def cloud(folder, name, corner=(0, 0, 0), step=0.05):
    """Terrain of points without faces, as PLY."""
    rows = ["%f %f %f" % (corner[0] + x * step, corner[1] + y * step, corner[2] + step * math.sin(x / 9) * math.cos(y / 7))
            for x in range(80) for y in range(80)]
    (folder / name).write_text(f"ply\nformat ascii 1.0\nelement vertex {len(rows)}\nproperty double x\nproperty double y\n"
                               "property double z\nend_header\n" + "\n".join(rows) + "\n")


def cube(folder, name):
    corners = [f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
    (folder / name).write_text("\n".join(corners + [f"f {face}" for face in faces]) + "\n")


def panorama(folder, name, width=64):
    """Radiance RGBE: a grey sky."""
    pixels = b"".join(struct.pack("4B", 128, 128, 64 + row, 128) for row in range(width // 2) for _ in range(width))
    (folder / name).write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (width // 2, width) + pixels)


def shot(folder, name):
    """GLB: a camera that comes nearer in three frames."""
    binary = struct.pack("<12f", 0, 1 / 24, 2 / 24, 0, 0, 0.5, 0, 0, 0.45, 0, 0, 0.4)
    json_text = json.dumps({
        "asset": {"version": "2.0"}, "nodes": [{"name": "Shot 2", "camera": 0}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "aspectRatio": 1.5, "znear": 0.01}}],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [{"buffer": 0, "byteLength": 12}, {"buffer": 0, "byteOffset": 12, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "SCALAR"},
                      {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                        "samplers": [{"input": 0, "output": 1}]}]}).encode()
    json_text += b" " * (-len(json_text) % 4)
    chunks = b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in ((b"JSON", json_text), (b"BIN\0", binary)))
    (folder / name).write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def e57(contents):
    """A file of what lies in its pages: each has 1,020 bytes of it and a checksum."""
    pages = -(-len(contents) // 1020)
    whole = (contents[:16] + struct.pack("<Q", pages * 1024) + contents[24:40] + struct.pack("<Q", 1024) +
             contents[48:]).ljust(pages * 1020, b"\0")
    return make_files.e57_pages(whole)


MEASURED = ("scan", "bunny")
MESHES = ("back front left right lion statue buddha dragon gargoyle room hall stairs tile".split() +
          ["lion left", "lion right"])
CLOUDS = ("terrain", "guanyin")
OBJECTS = ("details", "scan", "nefertiti", "armadillo")
MODELS = "scan bust lion right a campaign".split()
IDENTITY = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
LION = 'input = "lion.ply"\ndepth = 6\n'

# What others have done before a block: page, a piece of its text, commands.
BEFORE = [
    ("docs/how-to/many-scans.md", "--merge 8", "for i in 0 1 2 4 5 6 7; do pbm-build -q campaign/*.laz --depth 14 -o campaign.pbvg "
     "--shard $i/8; done"),
    ("docs/reference/cmake.md", "cmake -S . -B build",
     "printf 'cmake_minimum_required(VERSION 3.25)\nproject(reader LANGUAGES C)\n' >CMakeLists.txt"),
]


def make(root, programs, folder):
    """Makes all of them in `folder`, which is empty."""
    corpus = root / "tests/fuzz/corpus"

    def copies(of, names):
        for name in names:
            (folder / name).parent.mkdir(exist_ok=True)
            shutil.copy(of, folder / name)

    mesh(folder, "mesh", False)
    mesh(folder, "measured", True)
    cloud(folder, "cloud")
    cube(folder, "cube")
    copies(folder / "mesh", [f"{name}.ply" for name in MESHES] +
           ["scans/lion.ply", "scans/front.ply", "scans/back.ply", "scans/hall/lion.ply"])
    copies(folder / "measured", [f"{name}.ply" for name in MEASURED])
    copies(folder / "cloud", [f"{name}.ply" for name in CLOUDS])
    copies(folder / "cube", [f"{name}.obj" for name in OBJECTS] + ["pot/texturedMesh.obj"])
    cloud(folder, "churo.ply", (871482, 8503672, 3450), 1)
    panorama(folder, "studio.hdr")
    shot(folder, "shot.glb")
    copies(corpus / "las/new.las", ["tile.las"])
    copies(corpus / "las/new.laz", ["campaign/1.laz", "campaign/2.laz"])
    (folder / "e57").write_bytes(e57((corpus / "e57/normals").read_bytes()))
    copies(folder / "e57", ["left.e57", "right.e57"])
    copies(corpus / "gltf/triangles.glb", ["cat.glb"])
    copies(corpus / "gltf/embedded.gltf", ["plough/scene.gltf"])
    for name, text in {
            "front.txt": IDENTITY,
            "back.txt": IDENTITY,
            "bun.conf": "bmesh front.ply 0 0 0 0 0 0 1\nbmesh back.ply 0 0 0 0 0 0 1\n",
            "points.txt": "".join(f"{x} {y} 0 9 {10 * x} {10 * y} 50 {x / 20}\n" for x in range(20) for y in range(20)),
            "lion.toml": LION,
            "scans/lion.toml": LION,
            "studio.toml": 'lights = "studio"\nshadows = true\ndepth = 6\n',
    }.items():
        (folder / name).write_text(text)

    def run(program, *words):
        subprocess.run([programs / program, *words], cwd=folder, check=True, capture_output=True)

    run("pbm-build", "-q", "mesh", "--input-format", "ply", "--depth", "8", "-o", "model")
    copies(folder / "model", [f"{name}.pbvg" for name in MODELS] + ["MODEL", "models/one.pbvg", "models/two.pbvg"])
    run("pbm-build", "-q", "tile.las", "--field", "classification", "--field", "intensity", "-o", "tile.pbvg")
    run("pbm-export", "-q", "scan.pbvg", "-o", "points.ply")
    damaged = bytearray((folder / "lion.pbvg").read_bytes())
    damaged[-100] ^= 1
    (folder / "damaged lion").write_bytes(damaged)
    run("pbm-validate", "-q", "-r", "--json=report.json", "models")
