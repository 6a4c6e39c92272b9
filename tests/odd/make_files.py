"""Small scans that are no plain text: binary bodies, other line ends, bytes of other formats."""

import random
import struct


def header(encoding, *lines):
    return "\n".join(("ply", f"format {encoding} 1.0", *lines, "end_header", "")).encode()


XYZ = [f"property float {axis}" for axis in "xyz"]
NORMALS = [f"property float n{axis}" for axis in "xyz"]
COLOURS = [f"property uchar {name}" for name in ("red", "green", "blue")]
FACES = ["element face 1", "property list uchar int vertex_indices"]
CORNERS = [(0, 0, 0.25), (1, 0, 0.25), (0, 2.5, 0.25)]


def triangle(encoding="binary_little_endian", actual=None):
    """One triangle with normals and colours; `actual`: the encoding of the numbers, where the header lies."""
    order = ">" if (actual or encoding) == "binary_big_endian" else "<"
    out = header(encoding, "element vertex 3", *XYZ, *NORMALS, *COLOURS, *FACES)
    for corner in CORNERS:
        out += struct.pack(order + "6f3B", *corner, 0, 0, 1, 10, 200, 13)  # colours that look like line ends
    return out + struct.pack(order + "B3i", 3, 0, 1, 2)


def ascii_triangle():
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in CORNERS) + "3 0 1 2\n"
    return header("ascii", "element vertex 3", *XYZ, *FACES) + rows.encode()


def split(file):
    """Header and body."""
    at = file.index(b"end_header\n") + len(b"end_header\n")
    return file[:at], file[at:]


def body_that_begins_with_line_end():
    out = header("binary_little_endian", "element vertex 2", *[f"property uchar {axis}" for axis in "xyz"])
    return out + bytes([10, 13, 10, 1, 2, 3])


def many_line_ends():
    """A valid file of bytes among which CR LF is common."""
    generator = random.Random(2)
    out = header("binary_little_endian", "element vertex 4000", *[f"property uchar {axis}" for axis in "xyz"], *FACES)
    for _ in range(12000):
        choice = generator.randrange(30)
        out += bytes([10 if choice < 10 else 13 if choice == 10 else generator.randrange(256)])
    return out + struct.pack("<B3i", 3, 0, 1, 2)


def counts_of_other_order():
    out = header("binary_little_endian", "element face 1", "property list int int vertex_indices", "element vertex 3", *XYZ)
    out += struct.pack(">4i", 3, 0, 1, 2)
    return out + b"".join(struct.pack(">3f", *corner) for corner in CORNERS)


def text_in_binary():
    return header("binary_little_endian", "element vertex 6", *XYZ) + b"0.123456 0.234567 1e-05\n" * 6


def stl(start=b"made by hand", attribute=0):
    out = start.ljust(80) + struct.pack("<I", 2)
    for corners in ((0, 0, 0, 1, 0, 0, 1, 1, 0), (0, 0, 0, 1, 1, 0, 0, 1, 0)):
        out += struct.pack("<12fH", 0, 0, 1, *corners, attribute)
    return out


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def e57_pages(data):
    """Pages of a file: each has 1,020 bytes and their checksum. `data`: whole pages."""
    pages = [data[i:i + 1020] for i in range(0, len(data), 1020)]
    return b"".join(page + struct.pack(">I", crc32c(page)) for page in pages)


def e57(names, points, more="", count=None):
    """An E57 file of one scan: a field of doubles for each name, all in one packet."""
    streams = [b"".join(struct.pack("<d", point[i]) for point in points) for i in range(len(names))]
    packet = struct.pack("<H", len(names)) + b"".join(struct.pack("<H", len(s)) for s in streams) + b"".join(streams)
    packet += bytes(-len(packet) % 4)
    packet = struct.pack("<BBH", 1, 0, len(packet) + 3) + packet
    section = struct.pack("<QQQQ", 1, 32 + len(packet), 80, 0) + packet
    fields = "".join(f'<{name} type="Float"/>' for name in names)
    xml = (
        '<e57Root type="Structure"><data3D type="Vector"><vectorChild type="Structure">'
        f'<points type="CompressedVector" fileOffset="48" recordCount="{len(points) if count is None else count}">'
        f'<prototype type="Structure">{fields}</prototype></points>{more}</vectorChild></data3D></e57Root>'
    ).encode()
    at = 48 + len(section)
    size = (at + len(xml) + 1019) // 1020 * 1020
    start = b"ASTM-E57" + struct.pack("<IIQQQQ", 1, 0, size // 1020 * 1024, at // 1020 * 1024 + at % 1020, len(xml), 1024)
    return e57_pages((start + section + xml).ljust(size, b"\0"))


CARTESIAN = ["cartesianX", "cartesianY", "cartesianZ"]
SPHERICAL = ["sphericalRange", "sphericalAzimuth", "sphericalElevation"]
E57_POSE = (
    '<pose type="Structure"><rotation type="Structure"><x type="Float">1</x></rotation>'
    '<translation type="Structure"><x type="Float">5</x></translation></pose>'
)


def files():
    """Name -> bytes."""
    little, big = triangle(), triangle("binary_big_endian")
    head, body = split(little)
    big_head, big_body = split(big)
    lines = many_line_ends()
    square = b"v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nf 1 2 3 4\r\n"
    return {
        "empty.obj": b"",
        "ply_little_endian.ply": little,
        "ply_big_endian.ply": big,
        "ply_ascii_crlf.ply": ascii_triangle().replace(b"\n", b"\r\n"),
        "ply_ascii_cr.ply": ascii_triangle().replace(b"\n", b"\r"),
        "ply_binary_cr.ply": head.replace(b"\n", b"\r") + body,
        "ply_binary_crlf.ply": big_head.replace(b"\n", b"\r\n") + big_body,
        "ply_crlf_after_end_header.ply": head[:-1] + b"\r\n" + body,
        "ply_body_begins_with_line_end.ply": body_that_begins_with_line_end(),
        "ply_translated_line_ends.ply": lines.replace(b"\r", b"").replace(b"\n", b"\r\n"),
        "ply_line_ends_taken_out.ply": b"".join((split(lines)[0], split(lines)[1].replace(b"\r\n", b"\n"))),
        "ply_wrong_byte_order.ply": triangle("binary_little_endian", "binary_big_endian"),
        "ply_wrong_byte_order_of_counts.ply": counts_of_other_order(),
        "ply_text_in_binary.ply": text_in_binary(),
        "ply_binary_in_text.ply": little.replace(b"binary_little_endian", b"ascii"),
        "ply_unknown_keyword_in_binary.ply": little.replace(b"element vertex", b"remark made by hand\nelement vertex"),
        "ply_binary_count_beyond_file.ply": little.replace(b"element face 1", b"element face 1000"),
        "ply_binary_list_length_lies.ply": little[:-13] + b"\xff" + little[-12:],
        "ply_binary_cut_in_list.ply": little.replace(b"element face 1", b"element face 2") + b"\x03\x00\x00\x00",
        "ply_binary_trailing_bytes.ply": little + b"more\xff",
        "png_bytes.ply": b"\x89PNG\r\n\x1a\n" + bytes(100),
        "gzip_bytes.ply": b"\x1f\x8b\x08\x00" + bytes(100),
        "obj_crlf.obj": square,
        "e57_points.e57": e57(CARTESIAN, CORNERS),
        "e57_pose.e57": e57([*CARTESIAN, "intensity"], [(*c, c[0]) for c in CORNERS], E57_POSE),
        "e57_states.e57": e57([*CARTESIAN, "cartesianInvalidState"], [(*c, i) for i, c in enumerate(CORNERS)]),
        "e57_spherical.e57": e57([*SPHERICAL, "nor:normalX", "nor:normalY", "nor:normalZ"], [(2, 0.5, 0.1, 0, 0, 1)]),
        "e57_no_points.e57": e57(CARTESIAN, []),
        "e57_count_lies.e57": e57(CARTESIAN, CORNERS, count=4),
        "e57_count_beyond_file.e57": e57(CARTESIAN, CORNERS, count=10**9),
        "e57_colours_of_one_field.e57": e57([*CARTESIAN, "colorRed", "acme:rain"], [(*c, 1, 2) for c in CORNERS]),
        "e57_cut_short.e57": e57(CARTESIAN, CORNERS * 20)[:1500],
        "e57_wrong_checksum.e57": e57(CARTESIAN, CORNERS).replace(b"data3D", b"data4D", 1),
        "stl_binary.STL": stl(),
        "stl_binary_begins_solid.stl": stl(b"solid peter"),
        "stl_attribute_bytes.stl": stl(attribute=0x7FFF),
        "stl_binary_cut_short.stl": stl()[:-20],
    }
