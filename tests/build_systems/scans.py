"""Small scans that name other files: each is a function that writes one into a folder, with the files that it names, and
returns its name and theirs."""

import json
import struct
import zlib


def png(colour, size=4):
    """A picture of one colour, three numbers of 0..255."""
    def block(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = (b"\0" + bytes(colour) * size) * size
    return (b"\x89PNG\r\n\x1a\n" + block(b"IHDR", struct.pack(">IIBBBBB", size, size, 8, 2, 0, 0, 0)) +
            block(b"IDAT", zlib.compress(rows)) + block(b"IEND", b""))


RED, BLUE = png((200, 20, 20)), png((20, 20, 200))


def ply(size, comment=""):
    """A triangle; scans of two sizes give two models."""
    return (f"ply\nformat ascii 1.0\ncomment {comment}\nelement vertex 3\nproperty float x\nproperty float y\n"
            f"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
            f"0 0 0\n{size} 0 0\n0 1 0\n3 0 1 2\n").encode()


def write_obj(folder):
    (folder / "scan.obj").write_text(
        "mtllib scan.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 3 0 0\nv 3 1 0\nv 2 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
        "usemtl a\nf 1/1 2/2 3/3\nf 1/1 3/2 4/3\nusemtl b\nf 5/1 6/2 7/3\nf 5/1 7/2 8/3\n")
    (folder / "scan.mtl").write_text("newmtl a\nmap_Kd a.png\nnewmtl b\nmap_Kd b.png\n")
    (folder / "a.png").write_bytes(RED)
    (folder / "b.png").write_bytes(BLUE)
    return "scan.obj", ["a.png", "b.png"]


def write_gltf(folder):
    places = struct.pack("<18f", 0, 0, 0, 1, 0, 0, 1, 1, 0, 2, 0, 0, 3, 0, 0, 3, 1, 0)
    corners = struct.pack("<12f", 0, 0, 1, 0, 1, 1, 0, 0, 1, 0, 1, 1)
    (folder / "scan.bin").write_bytes(places + corners)
    primitive = [{"attributes": {"POSITION": 2 * i, "TEXCOORD_0": 2 * i + 1}, "material": i} for i in range(2)]
    accessors = []
    for i in range(2):
        accessors += [{"bufferView": 0, "byteOffset": 36 * i, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [2 * i, 0, 0], "max": [2 * i + 1, 1, 0]},
                      {"bufferView": 1, "byteOffset": 24 * i, "componentType": 5126, "count": 3, "type": "VEC2"}]
    (folder / "scan.gltf").write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitive}], "accessors": accessors,
        "bufferViews": [{"buffer": 0, "byteLength": 72}, {"buffer": 0, "byteOffset": 72, "byteLength": 48}],
        "buffers": [{"uri": "scan.bin", "byteLength": 120}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}} for i in range(2)],
        "textures": [{"source": i} for i in range(2)], "images": [{"uri": "a.png"}, {"uri": "b.png"}]}))
    (folder / "a.png").write_bytes(RED)
    (folder / "b.png").write_bytes(BLUE)
    return "scan.gltf", ["a.png", "b.png"]


def write_ply(folder):
    (folder / "scan.ply").write_text(
        "ply\nformat ascii 1.0\ncomment TextureFile a.png\ncomment TextureFile b.png\nelement vertex 6\nproperty float x\n"
        "property float y\nproperty float z\nelement face 2\nproperty list uchar int vertex_indices\n"
        "property list uchar float texcoord\nproperty int texnumber\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n2 0 0\n3 0 0\n3 1 0\n3 0 1 2 6 0 0 1 0 1 1 0\n3 3 4 5 6 0 0 1 0 1 1 1\n")
    (folder / "a.png").write_bytes(RED)
    (folder / "b.png").write_bytes(BLUE)
    return "scan.ply", ["a.png", "b.png"]


def write_alignment(folder):
    (folder / "scan.conf").write_text("camera 0 0 0 0 0 0 1\nbmesh a.ply 0 0 0 0 0 0 1\nbmesh b.ply 0 0 3 0 0 0 1\n")
    (folder / "a.ply").write_bytes(ply(1))
    (folder / "b.ply").write_bytes(ply(2))
    return "scan.conf", ["a.ply", "b.ply"]
