#!/usr/bin/env python3
"""Makes format_spec/mask_ranks.txt again: train_mask_ranks.py BIN SCANS WORK_FOLDER [-o TABLE] [--without NAME...]

BIN holds pbm-build, pbm-sample and train_mask_ranks, SCANS the scans of MIX below. Every model counts the same, whatever
its size: its histograms are divided by its points. Built models stay in WORK_FOLDER and are used again. Equal inputs
give an equal table, byte for byte. --without leaves models out whose name starts with NAME, to measure those with a
table that has not seen them; --build-only trains nothing. The scans are described in bench/README.md.
"""
import argparse
import array
import math
import pathlib
import subprocess

# Name of the model, its scan, depths. Those that end in "!" are made below.
MIX = [
    ("bunny", "bun_zipper.ply", (8, 9, 10)),
    ("dragon", "dragon_vrip_res2.ply", (8, 9)),
    ("gargo", "gargo.ply", (7, 8)),
    ("lion", "lion_takanawa_rgb_normals_le.ply", (8, 9)),
    ("guanyin", "Guanyin.ply", (8, 9)),
    ("churo", "churo_uav_thin.ply", (8, 9)),
    ("fragment", "open3d_fragment_002.ply", (8,)),
    ("buddha", "happy_stand15_mesh_le.ply", (9, 10)),
    ("buddha_points", "happy_points_normals_be_thin.ply", (8, 9)),
    ("armadillo", "armadillo43k.obj", (9,)),
    ("armadillo_points", "armadillo43k.obj!", (7, 8)),
    ("nefertiti", "nefertiti.obj", (9,)),
    ("nefertiti_points", "nefertiti.obj!", (8,)),
    ("lucy", "vtk_lucy.ply", (9,)),
    ("horse", "vtk_horse.ply", (9,)),
    ("camelhead", "camelhead.off", (9,)),
    ("spot", "spot.obj", (9,)),
    ("suzanne", "suzanne.obj", (9,)),
    ("teapot", "teapot.obj", (9,)),
    ("ammonite", "ammonite!", (9,)),
    ("boxes", "boxes!", (9,)),
    ("spheres", "spheres!", (9,)),
    ("sphere_points", "sphere_points!", (7, 8)),
]


def write_ply(path, vertices, triangles=()):
    """Binary PLY; coordinates come from + - * / sqrt alone, so that they are the same everywhere."""
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz")
    if triangles:
        header += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\n"
    body = array.array("d", (c for v in vertices for c in v)).tobytes()
    body += b"".join(b"\x03" + array.array("i", t).tobytes() for t in triangles)
    path.write_bytes(header.encode() + b"end_header\n" + body)


def turned(v, quaternion):
    """`v` turned by a quaternion of integers."""
    a, b, c, d = quaternion
    n = a * a + b * b + c * c + d * d
    rows = ((a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)),
            (2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)),
            (2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d))
    return tuple((r[0] * v[0] + r[1] * v[1] + r[2] * v[2]) / n for r in rows)


def cube_grid(cells):
    """The six faces of the cube -1..1 as a grid of vertices and triangles that look outwards."""
    vertices, triangles = [], []
    for axis in range(3):
        for side in (-1, 1):
            first = len(vertices)
            for i in range(cells + 1):
                for j in range(cells + 1):
                    v = [0, 0, 0]
                    v[axis], v[axis - 2], v[axis - 1] = side, 2 * i / cells - 1, 2 * j / cells - 1
                    vertices.append(tuple(v))
            for i in range(cells):
                for j in range(cells):
                    a = first + i * (cells + 1) + j
                    b, c, d = a + cells + 1, a + 1, a + cells + 2
                    triangles += [(a, b, d), (a, d, c)] if side > 0 else [(a, d, b), (a, c, d)]
    return vertices, triangles


def together(parts, path):
    vertices, triangles = [], []
    for part_vertices, part_triangles in parts:
        first = len(vertices)
        vertices += part_vertices
        triangles += [tuple(first + i for i in t) for t in part_triangles]
    write_ply(path, vertices, triangles)


def make_boxes(path):
    """Eight boxes, turned every way: planes and straight edges."""
    parts = []
    for k in range(8):
        vertices, triangles = cube_grid(1)
        centre = [3 * (k >> i & 1) for i in range(3)]
        turn = (7, 1 + k, 3 * k - 8, 5 - k)
        parts.append(([tuple(c + x for c, x in zip(centre, turned((v[0], v[1] * 0.75, v[2] * 0.5), turn))) for v in vertices],
                      triangles))
    together(parts, path)


def unit(v):
    length = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return tuple(c / length for c in v)


def make_spheres(path):
    """Spheres from the size of the grid down to a few voxels: every normal, every curvature."""
    parts, corner = [], 0.0
    for k in range(6):
        vertices, triangles = cube_grid(48)
        radius = 1 / 2**k
        parts.append(([tuple(corner + radius * c for c in unit(v)) for v in vertices], triangles))
        corner += 1.5 * radius
    together(parts, path)


def make_sphere_points(path):
    """A sparse, noisy cloud: 60,000 points near two spheres."""
    state, points = 1, []

    def random():
        nonlocal state
        state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
        return (state >> 11) / 2**53

    while len(points) < 60000:
        v = tuple(2 * random() - 1 for _ in range(3))
        if 0.01 < sum(c * c for c in v) < 1:
            radius = (1 if len(points) % 3 else 0.4) + 0.006 * (random() + random() - 1)
            points.append(tuple(radius * c for c in unit(v)))
    write_ply(path, points)


def vertices_of(obj, path):
    rows = (line.split() for line in obj.read_text(errors="replace").splitlines() if line.startswith("v "))
    write_ply(path, [tuple(map(float, row[1:4])) for row in rows])


def input_of(name, scan, arguments):
    """The file to build: a scan, or one made now."""
    if not scan.endswith("!"):
        return arguments.scans / scan
    path = arguments.work / f"{name}.ply"
    if not path.exists():
        if scan == "ammonite!":
            subprocess.run([arguments.bin / "pbm-sample", "-q", "--vertices", "1000000", "-o", path], check=True)
        elif scan.endswith(".obj!"):
            vertices_of(arguments.scans / scan[:-1], path)
        else:
            {"boxes!": make_boxes, "spheres!": make_spheres, "sphere_points!": make_sphere_points}[scan](path)
    return path


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for folder in ("bin", "scans", "work"):
        parser.add_argument(folder, type=pathlib.Path)
    parser.add_argument("-o", dest="table", type=pathlib.Path, default=pathlib.Path("format_spec/mask_ranks.txt"))
    parser.add_argument("--without", nargs="*", default=[])
    parser.add_argument("--build-only", action="store_true")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    models = []
    for name, scan, depths in MIX:
        for depth in depths:
            model = arguments.work / f"{name}{depth}.pbvg"
            if not model.exists():
                source = input_of(name, scan, arguments)
                subprocess.run([arguments.bin / "pbm-build", "-q", source, "--depth", str(depth), "-o", model], check=True)
            if not any(name.startswith(left_out) for left_out in arguments.without):
                models.append(model)
    if not arguments.build_only:
        subprocess.run([arguments.bin / "train_mask_ranks", arguments.table, *models], check=True)


if __name__ == "__main__":
    main()
