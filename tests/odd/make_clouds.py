"""Small files of LAS, LAZ, PCD, tables of points and glTF."""

import base64
import gzip
import json
import pathlib
import struct

POINTS = [(0, 0, 1), (100, 0, 2), (0, 200, 3)]

FILES = pathlib.Path(__file__).resolve().parent / "files"


def las_header(point_format, size, count, records=b"", scale=0.01, highest=(1, 2, 0.03), lowest=(0, 0, 0.01)):
    """LAS 1.4; `records`: variable length records."""
    out = bytearray(375)
    out[:4] = b"LASF"
    out[24:26] = 1, 4
    struct.pack_into("<HII", out, 94, 375, 375 + len(records), 1 if records else 0)
    struct.pack_into("<BHI", out, 104, point_format, size, count)
    struct.pack_into("<6d", out, 131, scale, scale, scale, 0, 0, 0)
    for axis in range(3):
        struct.pack_into("<dd", out, 179 + 16 * axis, highest[axis], lowest[axis])
    return bytes(out) + records


def las(points=POINTS, flags=(0, 0, 0), count=None, extra=b"", records=b"", **header):
    """Format 0, or with `extra` bytes behind each point."""
    body = b"".join(
        struct.pack("<3iHBBbBH", *point, 10 * i, 0, flag, 0, 0, 0) + extra
        for i, (point, flag) in enumerate(zip(points, flags))
    )
    return las_header(0, 20 + len(extra), len(points) if count is None else count, records, **header) + body


def las_colours(highest):
    body = b"".join(struct.pack("<3iHBBbBH3H", *point, 0, 0, 0, 0, 0, 0, highest, 0, 7) for point in POINTS)
    return las_header(2, 26, 3) + body


def extra_record():
    described = bytearray(192)
    described[2] = 1  # a byte without sign
    described[4:8] = b"echo"
    return struct.pack("<H16sHH32x", 0, b"LASF_Spec", 4, 192) + bytes(described)


def damaged(file, at, value):
    return file[:at] + bytes([value]) + file[at + 1:]


def spz(version, splats=2):
    rotations = 4 if version == 3 else 3
    places = bytes([0, 16, 0, 0, 32, 0, 0, 64, 0]) * 2
    header = b"NGSP" + struct.pack("<II4B", version, splats, 0, 12, 0, 0)
    body = header + places + b"\xff\xff" + bytes(2 * (3 + 3 + rotations))
    return gzip.compress(body, mtime=0)


def packed_splats():
    """Two splats in one chunk, as PlayCanvas writes them."""
    bounds = [f"{end}_{axis}" for part in ("", "scale_") for end in ("min", "max") for axis in (part + "x", part + "y", part + "z")]
    names = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
    header = ["ply", "format binary_little_endian 1.0", "element chunk 1", *(f"property float {name}" for name in bounds),
              "element vertex 2", *(f"property uint {name}" for name in names), "end_header", ""]  # fmt: skip
    row = struct.pack("<4I", 0, 0x20080200, 0x7FF, 0xFF8000FF), struct.pack("<4I", 0xFFFFFFFF, 0x20080200, 0x7FF, 0xFF)
    return "\n".join(header).encode() + struct.pack("<12f", 0, 0, 0, 2, 2, 2, -4, -4, -4, 0, 0, 0) + b"".join(row)


def pcd(data, fields="x y z", viewpoint="0 0 0 1 0 0 0", count=2):
    columns = len(fields.split())
    return (
        f"# .PCD v0.7\nVERSION 0.7\nFIELDS {fields}\nSIZE {'4 ' * columns}\nTYPE {'F ' * columns}\n"
        f"COUNT {'1 ' * columns}\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT {viewpoint}\nPOINTS {count}\nDATA "
    ).encode() + data


def gltf(changes=None, **root):
    """A triangle, its buffer in the file. `changes`: of the primitive."""
    places = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    uri = "data:application/octet-stream;base64," + base64.b64encode(places).decode()
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, **(changes or {})}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": uri}],
        **root,
    }
    return json.dumps({key: value for key, value in document.items() if value is not None}).encode()


def not_finite():
    uri = "data:;base64," + base64.b64encode(struct.pack("<9f", *[float("inf")] * 9)).decode()
    return gltf(buffers=[{"byteLength": 36, "uri": uri}])


def coloured():
    """The triangle, with colours as bytes behind the positions."""
    places = struct.pack("<9f12B", 0, 0, 0, 1, 0, 0, 0, 1, 0, *[255, 0, 0, 255] * 3)
    return gltf(
        {"attributes": {"POSITION": 0, "COLOR_0": 1}},
        accessors=[
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 3, "type": "VEC4", "normalized": True},
        ],
        bufferViews=[{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 12}],
        buffers=[{"byteLength": 48, "uri": "data:;base64," + base64.b64encode(places).decode()}],
    )


def ktx2():
    return gltf(
        {"material": 0},
        extensionsRequired=["KHR_texture_basisu"],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        textures=[{"extensions": {"KHR_texture_basisu": {"source": 0}}}],
    )


def files():
    """Name -> bytes."""
    laz = (FILES / "laz_chunked.laz").read_bytes()
    return {
        "las.las": las(),
        "las_8_bit_colours.las": las_colours(200),
        "las_16_bit_colours.las": las_colours(51400),
        "las_withheld.las": las(flags=(0, 0x80, 0)),
        "las_class.las": las(flags=(2, 2, 7)),
        "las_count_lies.las": las(count=2),
        "las_count_missing.las": las(count=0),
        "las_bounds_lie.las": las(highest=(9, 9, 9)),
        "las_cut_short.las": las(count=4),
        "las_trailing_bytes.las": las() + b"more",
        "las_extra_bytes.las": las(extra=b"\x09", records=extra_record()),
        "las_unnamed_extra_bytes.las": las(extra=b"\x09"),
        "las_point_format_11.las": las_header(11, 20, 3) + bytes(60),
        "laz_without_record.laz": las_header(0x80, 20, 3) + bytes(60),
        "laz_before_laszip_1.laz": las_header(0xC0, 20, 3) + bytes(60),
        "laz_cut_short.laz": laz[:-30],
        "laz_damaged_chunk.laz": damaged(laz, len(laz) - 150, laz[len(laz) - 150] ^ 0x10),
        "laz_count_beyond_file.laz": laz[:107] + struct.pack("<I", 2**31 - 1) + laz[111:],
        "laz_other_compressor.laz": damaged(laz, 375 + 54, 4),
        "laz_other_version.laz": damaged(laz, 375 + 54 + 34 + 4, 6),
        "ply_packed_splats.ply": packed_splats(),
        "spz_2.spz": spz(2),
        "spz_3.spz": spz(3),
        "spz_5.spz": spz(5),
        "spz_cut_short.spz": spz(3, 3),
        "pcd_ascii.pcd": pcd(b"ascii\n1 2 3\n4 5 6\n"),
        "pcd_binary.pcd": pcd(b"binary\n" + struct.pack("<6f", 1, 2, 3, 4, 5, 6)),
        "pcd_missing_returns.pcd": pcd(b"ascii\n1 2 3\nnan nan nan\n"),
        "pcd_viewpoint.pcd": pcd(b"ascii\n1 2 3\n4 5 6\n", viewpoint="0 0 9 1 0 0 0"),
        "pcd_commas.pcd": pcd(b"ascii\n1,2,3\n4,5,6\n"),
        "pcd_cut_short.pcd": pcd(b"binary\n" + bytes(20)),
        "pcd_trailing_bytes.pcd": pcd(b"binary\n" + bytes(24) + b"more"),
        "pcd_page.pcd": pcd(b"binary\n" + struct.pack("<6f", 1, 2, 3, 4, 5, 6) + bytes(100)),
        "pcd_unknown_data.pcd": pcd(b"ascii-1 2 3\n4 5 6\n"),
        "pcd_no_header.pcd": b"# .PCD v0.7\n1 2 3\n4 5 6\n",
        "table_guessed.xyz": b"1 2 3 0 0 1 10 20 30\n4 5 6 0 1 0 40 50 60\n",
        "table_named.csv": b"x,y,z,label\n1,2,3,7\n4,5,6,8\n",
        "table_units.csv": b"x,y,z\nm,m,m\n1,2,3\n4,5,6\n",
        "table_counted.pts": b"2\n1 2 3 -500 1 2 3\n4 5 6 -600 4 5 6\n",
        "table_cut_short.pts": b"3\n1 2 3\n4 5 6\n",
        "table_decimal_commas.csv": b"X;Y;Z\n1,5;2;3\n4;5,25;6\n",
        "table_no_rows.txt": b"Readme\nnothing here\n",
        "table_with_nul.txt": b"x y z\n1 2 \0\n",
        "gltf.gltf": gltf(),
        "gltf_colours.gltf": coloured(),
        "gltf_points.gltf": gltf({"mode": 0}),
        "gltf_lines.gltf": gltf({"mode": 1}),
        "gltf_animations.gltf": gltf(animations=[{}], skins=[{}]),
        "gltf_ktx2.gltf": ktx2(),
        "gltf_1.gltf": gltf(asset={"version": "1.0"}),
        "gltf_no_asset.gltf": gltf(asset=None),
        "gltf_node_cycle.gltf": gltf(nodes=[{"children": [0]}]),
        "gltf_no_buffer.gltf": gltf(buffers=[{"byteLength": 36, "uri": "no_such_file.bin"}]),
        "gltf_no_meshes.gltf": gltf(nodes=[{}]),
        "gltf_nothing_finite.gltf": not_finite(),
        "gltf_index_beyond.gltf": gltf({"indices": 7}),
        "gltf_damaged_index.gltf": gltf({"indices": -1}),
        "gltf_unknown_extension.gltf": gltf(extensionsRequired=["ACME_hidden"]),
    }
