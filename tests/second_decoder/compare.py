"""Holds the library's verdicts against the second decoder's:

    compare.py PBM_VALIDATE --files LARGEST RAW PATH...
    compare.py PBM_VALIDATE FOLDER COUNT [SEED [FILE.pbvg ...]]

The first form asks both programs about all different .pbvg files that are named or lie in the folders named, of at most
LARGEST bytes, whose streams have at most RAW bytes.

The second COUNT times changes a byte, a number or a few of them in a valid file (those of format_spec/vectors/valid, or the
files named), mostly repairs the hashes above the change, and asks about that; those on which they disagree stay in FOLDER.

They must agree whether a file is valid, and the rule and the offset that the decoder names must be among what the library
finds. Exit code 0: all agree, 1: some do not, 77: Python packages are missing.
"""

import hashlib
import json
import multiprocessing
import random
import struct
import subprocess
import sys
from pathlib import Path

try:
    import bvg
    from header import BRICKS, CHUNKS, DIRECTORY, RASTERS, STREAM_DIRECTORY, STREAM_VALUES
    from streams import xxh3
except ModuleNotFoundError as missing:
    print(f"skipped: the Python package {missing.name} is missing (python3-zstandard, python3-xxhash)")
    sys.exit(77)

VECTORS = Path(__file__, "../../../format_spec/vectors/valid").resolve()
EDGES = [struct.pack(f"<{form}", v) for form, v in (
    ("B", 0), ("B", 1), ("B", 255), ("H", 0), ("H", 65535), ("I", 0), ("I", 1), ("I", 2 ** 31), ("I", 2 ** 32 - 1),
    ("Q", 0), ("Q", 2 ** 63), ("Q", 2 ** 64 - 1), ("f", -0.0), ("f", 1.0), ("f", -1.0), ("f", 1e30), ("f", float("nan")),
    ("f", float("inf")), ("d", float("nan")), ("d", 1e308), ("d", 5e-324))]
METADATA = (
    b'{"a":1e400}', b'{"a":[[1]],"a":2}', b'{"a":"\\ud800"}', b'{"a":"\\ud83d\\ude00"}', b'{"\xc3\xa9":-0}', b'{"a":"\xff"}',
    b'{"a":01}', b'{"a":1}\n', b'{"a":"\t"}',
    b"\xef\xbb\xbf{}", b"[" * 40 + b"]" * 40,
    b'{"a":' + b"[" * 31 + b"]" * 31 + b"}",
    b'{"a":' + b"[" * 32 + b"]" * 32 + b"}", b'{"a":1e-400}', b'{"a":9' + b"9" * 309 + b"}", b'{"a":Infinity}', b"", b"{}", b'"a"')

# Two rules at one place of which either may be named: a wrong size of a plane cuts its frame short too.
EITHER = {"5.8.1": "5.6.1"}

def put(data, at, form, value):
    struct.pack_into(f"<{form}", data, at, value)

def hash_range(data, at, first, end):
    put(data, at, "Q", xxh3(bytes(data[first:end])))

def repair(data, m):
    """New hashes for everything from chunks and tiles to the header; `m` is the file before the change."""
    for level, chunks in enumerate(m.directories[1:], 1):
        section = m.section[CHUNKS, level]
        ends = [c.offset for c in chunks[1:]] + [section.offset + section.stored]
        for c, end in zip(chunks, ends):
            hash_range(data, c.at + 8, c.offset, end)
    for e, (*_, tiles) in m.rasters:
        for number, (part, _) in enumerate(tiles):
            hash_range(data, e.offset + 32 + 16 * number, part.offset, part.offset + part.stored)
        hash_range(data, e.offset, e.offset + 8, e.offset + 32 + 16 * len(tiles))
    for e in m.entries:
        if e.type == STREAM_DIRECTORY:
            offset = m.section[STREAM_VALUES, e.instance].offset
            for at in range(e.offset, e.offset + e.stored, 16):
                size = struct.unpack_from("<I", m.data, at + 8)[0] & 0xFFFFFF
                hash_range(data, at, offset, offset + size)
                offset += size
    for e in m.entries:
        hash_range(data, e.at + 56, e.offset, e.offset + e.stored)
    hash_range(data, 112, 128, 128 + 64 * m.sections)
    hash_range(data, 120, 0, 120)

def places(m):
    """Parts of the file, each drawn as often as any other, however small."""
    parts = [(0, 128), (128, 128 + 64 * m.sections)]
    parts += [(e.offset, e.offset + e.stored) for e in m.entries if e.stored]
    parts += [(e.offset, e.offset + 64) for e in m.entries if e.type in (*RASTERS, DIRECTORY, BRICKS)]
    parts += [(p.offset, p.offset + 12) for chunks in m.directories for c in chunks for p in c.parts if p.filter]
    return [(first, min(end, len(m.data))) for first, end in parts]

def change(data, m, rng):
    """One change in place."""
    first, end = rng.choice(places(m))
    at = rng.randrange(first, end)
    what = rng.randrange(4)
    if what == 0:
        data[at] ^= 1 << rng.randrange(8)
    elif what == 1:
        data[at] = rng.randrange(256)
    elif what == 2:
        data[at] = (data[at] + rng.choice((1, 255))) % 256
    else:
        edge = rng.choice(EDGES)
        at -= (at - first) % len(edge)
        edge = edge[:len(data) - at]
        data[at:at + len(edge)] = edge

def with_metadata(m, text):
    """The file with other metadata; spaces fill up what is too short. None where there is no room."""
    e = m.entries[0]
    if len(text) > e.stored:
        return None
    data = bytearray(m.data)
    data[e.offset:e.offset + e.stored] = text.ljust(e.stored) if text else b"\0" * e.stored
    return data

def mutant(m, rng):
    if rng.random() < 0.1:
        data = with_metadata(m, rng.choice(METADATA))
        if data is not None:
            repair(data, m)
            return data
    data = bytearray(m.data)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        change(data, m, rng)
    draw = rng.random()
    if draw < 0.9:
        repair(data, m)
    if 0.85 < draw:
        del data[rng.randrange(len(data)):]
    if draw < 0.6:
        with_content_id(data)
    return data

def with_content_id(data):
    """A new content_id where that is all that is wrong, so that sound changes make valid files."""
    try:
        bvg.read(data)
    except bvg.BvgError as error:
        if error.rule == "8.1":
            data[72:88] = bvg.content_id(error.model)
            hash_range(data, 120, 0, 120)

def decoders_verdict(data):
    try:
        bvg.read(data)
    except bvg.BvgError as error:
        return error.rule, error.offset
    return None

def verdict_of_file(path):
    return decoders_verdict(path.read_bytes())

def options(program):
    """What makes pbm-validate verify everything and say all of it."""
    page = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
    return ["--json", "--max-findings", "1000000", "--max-per-code", "1000000"] + (["--deep"] if "--deep" in page else [])

def librarys_verdicts(program, paths):
    """For each file the set of (rule, offset) that pbm-validate finds, or None if it is valid."""
    run = subprocess.run([program, *options(program), *map(str, paths)], capture_output=True, check=False)
    if run.returncode not in (0, 3, 5):
        sys.exit(f"{program}: exit code {run.returncode}: {run.stderr.decode()}")
    document = json.loads(run.stdout)
    files = document["files"] if isinstance(document, dict) else document
    return [None if file["valid"] else {(f["message"].split()[0], f.get("offset")) for f in file["findings"]} for file in files]

def agree(ours, theirs):
    if ours is None or theirs is None:
        return ours is theirs
    rule, offset = ours
    return ours in theirs or (EITHER.get(rule), offset) in theirs

def compare_batch(program, batch):
    """The disagreements about files, (path, the decoder's verdict) each, as lines of text."""
    wrong = {}
    for (path, ours), theirs in zip(batch, librarys_verdicts(program, [path for path, _ in batch]) if batch else ()):
        if not agree(ours, theirs):
            library = sorted(theirs) if theirs else "valid"
            wrong[path] = f"{path}: the decoder says {ours or 'valid'}, the library {library}"
    return wrong

def report(wrong, what):
    print("\n".join(wrong[:50]), end="\n" if wrong else "")
    print(f"{what}; {len(wrong)} disagreements")
    return 1 if wrong else 0

def raw_bytes(data):
    """What the header says that all streams of a file have, or 0 where the header is cut off: the decoder's work."""
    return int.from_bytes(data[64:72], "little")

def distinct_files(paths, most_bytes, most_raw):
    """The files at paths and below that are small enough, the first of those with the same bytes."""
    found = {}
    for file in (file for path in paths for file in (sorted(path.rglob("*.pbvg")) if path.is_dir() else [path])):
        if file.is_file() and file.stat().st_size <= most_bytes:
            data = file.read_bytes()
            if raw_bytes(data) <= most_raw:
                found.setdefault(hashlib.sha256(data).digest(), file)
    return list(found.values())

def compare_files(program, files):
    with multiprocessing.Pool() as pool:
        batch = list(zip(files, pool.map(verdict_of_file, files, chunksize=8)))
    valid = sum(ours is None for _, ours in batch)
    return report(list(compare_batch(program, batch).values()), f"{len(batch)} files: {valid} valid")

def compare_mutants(program, folder, count, seed, files):
    rng, folder = random.Random(seed), Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    models = [bvg.read(path.read_bytes()) for path in files]
    wrong, valid, named = [], 0, set()
    for start in range(0, count, 250):
        batch = []
        for number in range(start, min(start + 250, count)):
            path = folder / f"mutant-{number}.pbvg"
            data = bytes(mutant(rng.choice(models), rng))
            path.write_bytes(data)
            batch.append((path, decoders_verdict(data)))
        disagreements = compare_batch(program, batch)
        wrong += disagreements.values()
        for path, ours in batch:
            valid += ours is None
            named |= {ours[0]} if ours else set()
            if path not in disagreements:
                path.unlink()
    return report(wrong, f"{count} changed files: {valid} valid, {count - valid} refused by {len(named)} rules")

def main(program, arguments):
    if arguments[0] == "--files":
        return compare_files(program, distinct_files([Path(name) for name in arguments[3:]], *map(int, arguments[1:3])))
    folder, count, seed = arguments[0], int(arguments[1]), int(arguments[2]) if len(arguments) > 2 else 1
    files = [Path(name) for name in arguments[3:]] or sorted(VECTORS.glob("*.pbvg"))
    return compare_mutants(program, folder, count, seed, files)

if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]) if len(sys.argv) > 3 else __doc__)
