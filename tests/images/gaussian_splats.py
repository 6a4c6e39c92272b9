#!/usr/bin/env python3
"""How much pictures of Gaussian splats differ from pictures of the splats themselves:
gaussian_splats.py BIN SPLATS.ply... [--least DECIBELS] [--size PIXELS] [--keep FOLDER]

The truth is drawn here: every splat is an ellipse on the screen, and all of them are blended from front to back. PBM
builds a model with the default options, with unlit materials, and draws it from the same three places. Prints PSNR of
each view. SPLATS are files of the method's own program or packed ones (.compressed.ply). --least: exits with 1 if a
view has less. --keep: keeps the pictures. Needs numpy and ImageMagick; without them or SPLATS it is skipped.

Based on: Zwicker, Pfister, van Baar, Gross. EWA splatting. 2002
          Kerbl, Kopanas, Leimkuehler, Drettakis. 3D Gaussian splatting for real-time radiance field rendering. 2023
"""
import argparse
import pathlib
import shutil
import subprocess
import sys
import tempfile

ANGLE = 30  # vertical, degrees
VIEWS = ((0, 10), (90, 10), (200, 35))  # azimuth and elevation, degrees
LOW_PASS = 0.3  # pixels squared: each ellipse is widened by a pixel's extent
HARMONIC = 0.28209479177387814
UP = (0, -1, 0)  # as the method's own program has it


def header_of(file):
    """The elements of a PLY header: name, number of rows, names of properties."""
    elements = []
    while (line := file.readline().decode().split()) != ["end_header"]:
        if line[0] == "element":
            elements.append((line[1], int(line[2]), []))
        elif line[0] == "property":
            elements[-1][2].append(line[2])
    return elements


def rows_of(file, element, kind):
    name, count, properties = element
    values = np.frombuffer(file.read(4 * count * len(properties)), kind).reshape(count, len(properties))
    return {property: values[:, i] for i, property in enumerate(properties)}


def fraction(words, shift, bits):
    most = (1 << bits) - 1
    return (words >> shift & most) / most


def unpack(chunks, rows):
    chunk = np.arange(len(rows["packed_position"])) // 256

    def between(names, fractions):
        low, high = ([chunks[f"{end}_{name}"][chunk] for name in names] for end in ("min", "max"))
        return np.stack([a + f * (b - a) for a, b, f in zip(low, high, fractions)], 1).astype(float)

    def thirds(words):
        return fraction(words, 21, 11), fraction(words, 11, 10), fraction(words, 0, 11)

    colour, turn = rows["packed_color"], rows["packed_rotation"]
    others = np.stack([(fraction(turn, shift, 10) - 0.5) * np.sqrt(2) for shift in (20, 10, 0)], 1)
    largest = turn >> 30
    rotation = np.empty((len(turn), 4))
    for k in range(4):
        of = largest == k
        rest = np.sqrt(np.maximum(1 - (others[of] ** 2).sum(1), 0))
        rotation[of] = np.insert(others[of], k, 0, axis=1)
        rotation[of, k] = rest
    return (between("xyz", thirds(rows["packed_position"])),
            between("rgb", [fraction(colour, shift, 8) for shift in (24, 16, 8)]),
            np.exp(between(("scale_x", "scale_y", "scale_z"), thirds(rows["packed_scale"]))),
            rotation, fraction(colour, 0, 8))  # fmt: skip


def read(path):
    """Centres, colours, scales, rotations w x y z, opacities."""
    with open(path, "rb") as file:
        elements = header_of(file)
        if elements[0][0] == "chunk":
            chunks = rows_of(file, elements[0], "<f4")
            return unpack(chunks, rows_of(file, elements[1], "<u4"))
        rows = {name: values.astype(float) for name, values in rows_of(file, elements[0], "<f4").items()}

    def several(*names):
        return np.stack([rows[name] for name in names], 1)

    return (several("x", "y", "z"), np.clip(0.5 + HARMONIC * several("f_dc_0", "f_dc_1", "f_dc_2"), 0, 1),
            np.exp(several("scale_0", "scale_1", "scale_2")), several("rot_0", "rot_1", "rot_2", "rot_3"),
            1 / (1 + np.exp(-rows["opacity"])))  # fmt: skip


def matrices(rotation):
    w, x, y, z = (rotation / np.linalg.norm(rotation, axis=1, keepdims=True)).T
    rows = ((1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)))  # fmt: skip
    return np.stack([np.stack(row, 1) for row in rows], 1)


def camera_axes(eye, target):
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, UP)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])  # to the right, downwards, away


def blend(splats, eye, target, size):
    """[size][size][3]: the splats before white."""
    centre, colour, scale, rotation, opacity = splats
    axes = camera_axes(eye, target)
    place = (centre - eye) @ axes.T
    focal = size / 2 / np.tan(np.radians(ANGLE) / 2)
    seen = place[:, 2] > 0.02 * np.linalg.norm(target - eye)
    place, colour, opacity = place[seen], colour[seen], opacity[seen]
    shape = np.einsum("ij,njk->nik", axes, matrices(rotation[seen])) * scale[seen][:, None, :]
    depth = place[:, 2]
    slope = np.zeros((len(place), 2, 3))
    slope[:, 0, 0] = slope[:, 1, 1] = focal / depth
    slope[:, :, 2] = -focal * place[:, :2] / depth[:, None] ** 2
    ellipse = slope @ (shape @ shape.transpose(0, 2, 1)) @ slope.transpose(0, 2, 1)
    ellipse[:, 0, 0] += LOW_PASS
    ellipse[:, 1, 1] += LOW_PASS
    inverse = np.linalg.inv(ellipse)
    middle = size / 2 + focal * place[:, :2] / depth[:, None]
    reach = 3 * np.sqrt(np.stack([ellipse[:, 0, 0], ellipse[:, 1, 1]], 1))
    low = np.maximum(np.floor(middle - reach), 0).astype(int)
    high = np.minimum(np.ceil(middle + reach) + 1, size).astype(int)
    picture, left = np.zeros((size, size, 3)), np.ones((size, size))
    for i in np.argsort(depth, kind="stable"):
        if (low[i] >= high[i]).any():
            continue
        x = np.arange(low[i, 0], high[i, 0]) + 0.5 - middle[i, 0]
        y = (np.arange(low[i, 1], high[i, 1]) + 0.5 - middle[i, 1])[:, None]
        form = inverse[i, 0, 0] * x * x + 2 * inverse[i, 0, 1] * x * y + inverse[i, 1, 1] * y * y
        alpha = np.minimum(opacity[i] * np.exp(-0.5 * form), 0.99)
        alpha[alpha < 1 / 255] = 0
        part = np.s_[low[i, 1] : high[i, 1], low[i, 0] : high[i, 0]]
        picture[part] += (left[part] * alpha)[:, :, None] * colour[i]
        left[part] *= 1 - alpha
    return picture + left[:, :, None]


def read_picture(path):
    ppm = subprocess.run(["convert", path, "-depth", "8", "ppm:-"], stdout=subprocess.PIPE, check=True).stdout
    _, size, _, pixels = ppm.split(b"\n", 3)
    width, height = map(int, size.split())
    return np.frombuffer(pixels, np.uint8).reshape(height, width, 3) / 255


def write_picture(picture, path):
    height, width, _ = picture.shape
    pixels = (np.clip(picture, 0, 1) * 255 + 0.5).astype(np.uint8).tobytes()
    subprocess.run(["convert", "ppm:-", path], input=b"P6\n%d %d\n255\n" % (width, height) + pixels, check=True)


def text(vector):
    """A vector as PBM has it: it turns such files upright."""
    return ",".join(repr(float(number)) for number in (vector[0], -vector[1], -vector[2]))


def views_of(splats):
    """Eye and target: the opaque splats without the outermost are in sight."""
    opaque = splats[0][splats[4] > 0.3]
    low, high = np.percentile(opaque, 2, 0), np.percentile(opaque, 98, 0)
    target, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
    for azimuth, elevation in np.radians(VIEWS):
        direction = np.array([np.sin(azimuth) * np.cos(elevation), -np.sin(elevation), np.cos(azimuth) * np.cos(elevation)])
        yield target + 2.9 * radius * direction, target


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("splats", type=pathlib.Path, nargs="+")
    parser.add_argument("--least", type=float, default=0)
    parser.add_argument("--size", type=int, default=600)
    parser.add_argument("--keep", type=pathlib.Path)
    arguments = parser.parse_args()
    for path in arguments.splats:
        if not path.exists():
            print(f"skipped: there is no {path}")
            sys.exit(77)
    work = arguments.keep or pathlib.Path(tempfile.mkdtemp())
    work.mkdir(parents=True, exist_ok=True)
    worst = float("inf")
    for path in arguments.splats:
        splats, model = read(path), work / "splats.pbvg"
        subprocess.run([arguments.bin / "pbm-build", path, "-o", model, "-q", "--material", "ka=1,kd=0,ks=0"], check=True)
        decibels = []
        for number, (eye, target) in enumerate(views_of(splats)):
            drawn = work / f"{path.stem}_{number}.png"
            subprocess.run(
                [arguments.bin / "pbm-render", model, "-o", drawn, "-q", "--resolution", f"{arguments.size},{arguments.size}",
                 "--camera-position", text(eye), "--camera-focal-point", text(target), "--camera-view-up", text(UP),
                 "--camera-view-angle", str(ANGLE), "--background-color", "1,1,1", "--no-panorama", "--no-shadows"],
                check=True)  # fmt: skip
            truth = blend(splats, eye, target, arguments.size)
            if arguments.keep:
                write_picture(truth, drawn.with_name(f"{path.stem}_{number}_truth.png"))
            decibels.append(-10 * np.log10(((read_picture(drawn) - truth) ** 2).mean()))
        print(f"{path.name}: {', '.join(f'{value:.1f}' for value in decibels)} dB", flush=True)
        worst = min(worst, *decibels)
    if not arguments.keep:
        shutil.rmtree(work)
    sys.exit(0 if worst >= arguments.least else f"less than {arguments.least} dB")


try:
    import numpy as np
except ImportError:
    print("skipped: numpy is not installed")
    sys.exit(77)
if not shutil.which("convert"):
    print("skipped: ImageMagick is not installed")
    sys.exit(77)
main()
