"""The same input and options give the same bytes: same_bytes.py PBM_BUILD BUILD_WITH_TARGET PBM_SAMPLE FOLDER [OPTIONS] [SCAN...]

Builds models with every feature, then varies number of threads, SIMD target, locale, time zone, folder, umask and
environment, and the order of vertices and faces in the scan, and compares whole files.
Each SCAN is built in all variations of --long. Exit code 0: all files are equal, 1: some differ.

  --long         all models in all variations, not only the first
  --vertices N   number of vertices of the sample scan
  --hashes FILE  where to write the hashes of the models, for comparison with those of another compiler
"""

import hashlib
import os
import random
import struct
import subprocess
import sys
import zlib
from pathlib import Path

# Name and options. Without --long only the first is built in all variations; the others vary threads only.
MODELS = (
    ("everything", ("--texture", "wood", "--ground", "marble", "--ground-resolution", "128", "--lights", "stage", "--shadows",
                    "--shadow-bits", "4", "--panorama", "PANORAMA", "--panorama-width", "256", "--name", "I\u0131\u0130i")),
    ("plain", ("--colour", "565",)),
    ("mapped", ("--store", "mapped", "--lights", "two", "--shadows", "--ground", "plain", "--panorama", "default",
                "--panorama-width", "256")),
    ("points", ("--material", "mirror", "--environment", "0.5")),       # from vertices without faces: estimated normals
)
LOCALES = (("de_DE", "UTF-8"), ("tr_TR", "UTF-8"), ("ja_JP", "EUC-JP"))     # decimal commas; dotless i; no UTF-8

def write_png(path, width, height):
    """Smooth colours with noise, eight bits a channel."""
    rng = random.Random(1)
    rows = [bytes([0]) + bytes((x * 255 // width + y * (c + 1) + rng.randrange(32)) % 256 for x in range(width) for c in range(3))
            for y in range(height)]
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(b"".join(rows))) + chunk(b"IEND", b""))

PLY_TYPES = {"char": "b", "int8": "b", "uchar": "B", "uint8": "B", "short": "h", "int16": "h", "ushort": "H", "uint16": "H",
             "int": "i", "int32": "i", "uint": "I", "uint32": "I", "float": "f", "float32": "f", "double": "d", "float64": "d"}

def split_ply(path):
    """Header lines, vertices (bytes) and faces (lists of corners) of a PLY that has no other elements, else None."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    lines = header.decode("ascii").splitlines()
    words = [line.split() for line in lines]
    elements = {word[1]: int(word[2]) for word in words if word[:1] == ["element"]}
    lists = [word for word in words if word[:2] == ["property", "list"]]
    if not set(elements) <= {"vertex", "face"} or len(lists) != (1 if "face" in elements else 0):
        raise ValueError(f"{path}: more than vertices and faces")
    count, order = elements["vertex"], {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}[words[1][1]]
    if not order:
        rows = body.splitlines()
        return lines, rows[:count], [list(map(int, row.split()))[1:] for row in rows[count:count + elements.get("face", 0)]]
    size = struct.calcsize("=" + "".join(PLY_TYPES[word[1]] for word in words if word[:1] == ["property"] and word not in lists))
    vertices = [body[i * size:(i + 1) * size] for i in range(count)]
    faces, at = [], count * size
    for _ in range(elements.get("face", 0)):
        corners, = struct.unpack_from(order + PLY_TYPES[lists[0][2]], body, at)
        row = struct.Struct(order + PLY_TYPES[lists[0][2]] + PLY_TYPES[lists[0][3]] * corners)
        faces.append(list(row.unpack_from(body, at))[1:])
        at += row.size
    return lines, vertices, faces

def write_ply(path, header, vertices, faces):
    words = [line.split() for line in header]
    order = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}[words[1][1]]
    if order:
        types = [PLY_TYPES[name] for word in words if word[:2] == ["property", "list"] for name in word[2:4]]
        rows = [struct.pack(order + types[0] + types[1] * len(face), len(face), *face) for face in faces]
    else:
        rows = [b" ".join(b"%d" % number for number in [len(face), *face]) for face in faces]
    end = b"" if order else b"\n"
    path.write_bytes("".join(f"{line}\n" for line in [*header, "end_header"]).encode() +
                     b"".join(row + end for row in [*vertices, *rows]))

def shuffled(vertices, faces, seed):
    """The same surface with vertices and faces in another order, and each face starting at another corner."""
    rng = random.Random(seed)
    order = list(range(len(vertices)))
    rng.shuffle(order)
    place = {old: new for new, old in enumerate(order)}
    turned = []
    for corners in faces:
        first = rng.randrange(len(corners))
        turned.append([place[i] for i in corners[first:] + corners[:first]])
    rng.shuffle(turned)
    return [vertices[i] for i in order], turned

def only_points(header, vertices):
    """Header and vertices of a scan without its faces."""
    inside, kept = False, []
    for line in header:
        inside = line.startswith("element face") or inside and line.startswith("property")
        kept += [] if inside else [line]
    return kept, vertices, []

def make_inputs(sample, folder, vertices):
    """Writes the scans of the models, in original and in shuffled order."""
    scan = folder / "scan.ply"
    subprocess.run([sample, "-q", "--ascii", "--vertices", str(vertices), "-o", scan], check=True)
    header, points, faces = split_ply(scan)
    assert points and faces
    other_points, other_faces = shuffled(points, faces, 1)
    write_ply(folder / "shuffled.ply", header, other_points, other_faces)
    write_ply(folder / "points.ply", *only_points(header, points))
    write_ply(folder / "points-shuffled.ply", *only_points(header, other_points))
    write_png(folder / "panorama.png", 300, 150)

def locale_variations(folder):
    """Compiles the locales whose sources the system has into a folder of the test."""
    for name, charset in LOCALES:
        target = folder / "locales" / f"{name}.{charset}"
        if not target.exists():
            target.parent.mkdir(exist_ok=True)
            subprocess.run(["localedef", "-c", "-i", name, "-f", charset, target], capture_output=True, check=False)
        if target.exists():
            chosen = {"LC_ALL": target.name, "LANG": target.name, "LOCPATH": str(target.parent)}
            yield f"locale {name}.{charset}", {"env": chosen}
        else:
            print(f"note: no locale {name}.{charset}")
    yield "locale C", {"env": {"LC_ALL": "C"}}

def target_variations(program):
    env = {**os.environ, "PBM_TEST_TARGET": "list"}
    listed = subprocess.run([program], env=env, check=True, capture_output=True, text=True).stdout.split("\n")
    for line in filter(None, listed):
        number, name = line.split()
        yield f"SIMD target {name}", {"program": program, "env": {"PBM_TEST_TARGET": number}}

def variations(folder, with_target, threads_only):
    """Name of each variation, and its difference from the first build."""
    yield from ((f"-j {n}", {"options": ("-j", str(n))}) for n in (2, 8))
    if threads_only:
        return
    yield from target_variations(with_target)
    yield from locale_variations(folder)
    yield "time zone", {"env": {"TZ": "Asia/Kathmandu"}}
    yield "umask 077", {"umask": 0o077}
    yield "empty environment", {"env": None}
    much = {f"PBM_{i}": "x" * 1000 for i in range(50)}
    yield "large environment", {"env": {**much, "HOME": "/nowhere", "TMPDIR": str(folder)}}
    yield "relative names", {"cwd": folder}
    yield "folder with a long name", {"to": "a folder with \u00fcnusual name" + "x" * 150}
    yield "a time later", {"time": 0}
    yield "through a pipe", {"pipe": True}
    yield "vertices and faces in another order", {"shuffled": True}

def build(program, folder, model, how):
    """Builds a model and returns the bytes of the file."""
    name, options = model[:2]
    if len(model) > 2:
        scan = folder / "scan-shuffled.ply" if how.get("shuffled") else model[2]
    elif how.get("shuffled"):
        scan = folder / ("points-shuffled.ply" if name == "points" else "shuffled.ply")
    else:
        scan = folder / ("points.ply" if name == "points" else "scan.ply")
    to = folder / how.get("to", "out") / "model.pbvg"
    to.parent.mkdir(exist_ok=True)
    if "time" in how:
        os.utime(scan, (how["time"], how["time"]))
    if "cwd" in how:
        scan, to = (os.path.relpath(path, folder) for path in (scan, to))
    env = {} if how.get("env", ()) is None else {**os.environ, **how.get("env", {})}
    panorama = "panorama.png" if "cwd" in how else str(folder / "panorama.png")
    command = [how.get("program", program), "-q", "-" if how.get("pipe") else scan, "--depth", "7", "-o", to,
               *(panorama if option == "PANORAMA" else option for option in options), *how.get("options", ("-j", "1"))]
    with open(folder / scan, "rb") as source:
        subprocess.run(command, check=True, env=env, cwd=how.get("cwd"), umask=how.get("umask", -1),
                       stdin=source if how.get("pipe") else subprocess.DEVNULL)
    return (folder / how.get("to", "out") / "model.pbvg").read_bytes()

def difference(a, b):
    first = next((i for i, (x, y) in enumerate(zip(a, b)) if x != y), min(len(a), len(b)))
    return f"{len(a)} and {len(b)} bytes, the first difference at {first}"

def shuffle_scan(scan, folder):
    """Writes scan-shuffled.ply; returns False if that is not possible."""
    try:
        header, points, faces = split_ply(scan)
    except (ValueError, KeyError, IndexError, struct.error):
        print(f"note: {scan.name} is no PLY of vertices and faces: not shuffled")
        return False
    write_ply(folder / "scan-shuffled.ply", header, *shuffled(points, faces, 1))
    return True

def check_model(programs, folder, model, threads_only, hashes):
    """Builds a model in all variations; returns those that differ."""
    program, with_target = programs
    first = build(program, folder, model, {})
    hashes.append(f"{hashlib.sha256(first).hexdigest()}  {model[0]}")
    wrong, count = [], 0
    if build(program, folder, model, {"options": ("--credit", "other bytes")}) == first:
        wrong.append(f"{model[0]}: another credit gives the same bytes: nothing is compared")
    for name, how in variations(folder, with_target, threads_only):
        if how.get("shuffled") and len(model) > 2 and not shuffle_scan(model[2], folder):
            continue
        again, count = build(program, folder, model, how), count + 1
        if again != first:
            wrong.append(f"{model[0]}: {name}: {difference(first, again)}")
    print(f"{model[0]}: {len(first)} bytes, {count} variations, {len(wrong)} differ", flush=True)
    return wrong

def main(program, with_target, sample, folder, *further):
    folder, long, hashes = Path(folder), "--long" in further, []
    values = {name: further[further.index(name) + 1] for name in ("--hashes", "--vertices") if name in further}
    scans = [Path(name).resolve() for name in further if not name.startswith("--") and name not in values.values()]
    folder.mkdir(parents=True, exist_ok=True)
    folder = folder.resolve()
    make_inputs(sample, folder, int(values.get("--vertices", 10000)))
    models = [*MODELS, *((scan.name, ("--lights", "two", "--shadows"), scan) for scan in scans)]
    programs, wrong = (Path(program).resolve(), Path(with_target).resolve()), []
    for number, model in enumerate(models):
        wrong += check_model(programs, folder, model, number > 0 and not long, hashes)
    print("\n".join(wrong), end="\n" if wrong else "")
    if "--hashes" in values:
        Path(values["--hashes"]).write_text("\n".join(hashes) + "\n", encoding="utf-8")
    return 1 if wrong else 0

if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]) if len(sys.argv) > 4 else __doc__)
