"""The models that sizes and times are measured on: where their scans come from and how they are built.

Scans lie in $PBM_SCANS_DIR, or come from ../shared/data beside the checkout, unpacked into the work folder. What is
made of them (marble, models, what peers make of them) stays in the work folder and is made again when it is older than
the scan or the program.
"""
import contextlib
import ctypes
import dataclasses
import json
import os
import pathlib
import shutil
import subprocess
import sys

import marble
import shells

SOURCE = pathlib.Path(__file__).resolve().parent.parent


@dataclasses.dataclass(frozen=True)
class Scan:
    name: str
    file: str  # empty: one of the project's own samples
    depth: int
    marble: bool = False  # no colours of its own: gets marble
    sample: tuple = ()  # options of pbm-sample
    wall: float = 0  # not 0: the thickness of the shell of shells.py


SAMPLE = Scan("ammonite", "", 7, sample=("--vertices", 20000))
CLOUD = Scan("statue", "", 8, sample=("--shape", "statue", "--points", 20000))  # points without normals
BUNNY = Scan("bunny", "bun_zipper.ply", 10, marble=True)
DRAGON = Scan("dragon", "dragon_vrip_res2.ply", 9, marble=True)
GARGOYLE = Scan("gargo", "gargo.ply", 8)
LION = Scan("lion", "lion_takanawa_rgb_normals_le.ply", 9)
FOUR = (BUNNY, DRAGON, GARGOYLE, LION)
# Walls of 1.3 voxels at depth 8, and of a fourth of one: both sides of a wall are in one voxel there.
SHELLS = tuple(Scan(f"shell-{wall:g}", "", 8, wall=wall) for wall in (0.01, 0.002))
# 10 M points and more, where times of decoding settle.
LARGE = (dataclasses.replace(BUNNY, depth=11), Scan("buddha", "happy_stand15_mesh_le.ply", 11, marble=True))

# A thread that has a processor for less of the time shares it with somebody: times of clocks are not judged then.
IDLE = 0.95


def add_arguments(parser):
    parser.add_argument("bin", nargs="?", type=pathlib.Path, default=SOURCE / "build/release/bin", metavar="BIN",
                        help="folder of built programs (default: build/release/bin)")
    parser.add_argument("--work", type=pathlib.Path, metavar="FOLDER",
                        help="where scans, models and results are kept (default: BIN/../bench)")
    parser.add_argument("--scans", default="", metavar="FOLDER", help="real scans (default: $PBM_SCANS_DIR, ../shared/data)")
    parser.add_argument("--json", nargs="?", const="-", default="", metavar="FILE",
                        help="all figures as JSON, too; without FILE instead of the tables, which go to standard error")
    parser.add_argument("-j", "--threads", type=int, default=0, help="threads of the programs (default: all)")


def tables_of(arguments):
    """Where tables are printed while this is entered: standard output, unless JSON goes there."""
    return contextlib.redirect_stdout(sys.stderr if arguments.json == "-" else sys.stdout)


def write_json(arguments, value):
    if arguments.json:
        text = json.dumps(value, indent=2) + "\n"
        sys.stdout.write(text) if arguments.json == "-" else pathlib.Path(arguments.json).write_text(text)


class Workshop:
    """Builds models in a folder; `missing` says why there are no real scans, or is empty."""

    def __init__(self, arguments):
        self.bin = arguments.bin.resolve()
        if not (self.bin / "pbm-build").exists():
            sys.exit(f"{self.bin}: no pbm-build here; build the project, then name the folder of its programs")
        self.work = (arguments.work or self.bin.parent / "bench").resolve()
        self.work.mkdir(parents=True, exist_ok=True)
        self.threads = arguments.threads
        self.scans, self.missing = None, ""
        given = arguments.scans or os.environ.get("PBM_SCANS_DIR", "")
        archive = SOURCE.parent / "shared" / "data" / "unpack.sh"
        if given:
            self.scans = pathlib.Path(given)
            if not self.scans.is_dir():
                sys.exit(f"{given}: no folder of scans")
        elif archive.exists() and shutil.which("zstd"):
            self.scans = self.work / "unpacked"
            if not (self.scans / "complete").exists():
                subprocess.run(["bash", archive, self.scans], check=True)
                (self.scans / "complete").touch()
        else:
            self.missing = f"no real scans: PBM_SCANS_DIR is not set and {archive} is not there (or zstd is not installed)"

    def why_not(self, scan):
        """What is missing for `scan`, or None."""
        if not scan.file:
            return None
        if self.missing:
            return self.missing
        return None if (self.scans / scan.file).exists() else f"{self.scans / scan.file} is not there"

    def run(self, program, *arguments, **options):
        command = [str(program), *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, **options)
        if done.returncode != 0:
            sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
        return done.stdout

    def made(self, path, sources, make):
        """`path`, made by make(temporary) unless it is there and newer than `sources`."""
        newest = max(os.stat(source).st_mtime_ns for source in sources)
        if not path.exists() or os.stat(path).st_mtime_ns < newest:
            part = path.with_name("part-" + path.name)  # the extension stays: programs look at it
            make(part)
            part.replace(path)
        return path

    def input(self, scan):
        """The PLY that the model is built from."""
        if scan.wall:
            return self.made(self.work / f"{scan.name}.ply", [shells.__file__],
                             lambda out: shells.write_shell(out, scan.wall))
        if not scan.file:
            program = self.bin / "pbm-sample"
            return self.made(self.work / f"{scan.name}-{scan.sample[-1]}.ply", [program],
                             lambda out: self.run(program, "-q", *scan.sample, "-o", out))
        original = self.scans / scan.file
        if not scan.marble:
            return original
        return self.made(self.work / f"{scan.name}-marble.ply", [original, marble.__file__],
                         lambda out: marble.write_marble(original, out))

    def model(self, scan, colour="", level=0, mapped=False, more=()):
        """`scan` built with default settings but for depth and compression level (0: the default), colour ("": the
        default), storage and `more` options."""
        ply, program = self.input(scan), self.bin / "pbm-build"
        options = ["-j", self.threads, *more]
        if scan.depth:
            options += ["--depth", scan.depth]
        if colour:
            options += ["--colour", colour]
        if mapped:
            options += ["--store", "mapped"]
        elif level:
            options += ["-z", level]
        stored = "mapped" if mapped else f"z{level or 'default'}"
        parts = [scan.name, f"d{scan.depth or 'default'}", colour, stored, *(str(option).strip("-") for option in more)]
        return self.made(self.work / ("-".join(filter(None, parts)) + ".pbvg"), [ply, program],
                         lambda out: self.run(program, "-q", ply, "-o", out, *options))

    def info(self, model):
        return json.loads(self.run(self.bin / "pbm-info", "--json", model))

    def helper(self, name):
        """A program of bench/, or None where it was not built."""
        program = self.bin / name
        return program if program.exists() else None

    def draco(self, model, info, geometry):
        """Draco's file of the finest voxels of `model`, or None where something for it is missing."""
        voxels, encoder = self.helper("bench_voxels"), shutil.which("draco_encoder")
        if not voxels or not encoder:
            return None

        def make(out):
            ply = out.with_suffix(".ply")
            self.run(voxels, "geometry" if geometry else "points", model, ply)
            self.run(encoder, "-point_cloud", "-cl", "10", "-qp", info["depth"], "-i", ply, "-o", out)
            ply.unlink()

        # What the voxels are does not change with the way they are stored.
        return self.made(self.work / f"{info['content_id']}-{'geometry' if geometry else 'points'}.drc", [voxels], make)

    def dissertation(self, model, info):
        """The dissertation's layout of `model` under zstd -19, or None where something for it is missing."""
        voxels = self.helper("bench_voxels")
        if not voxels or not shutil.which("zstd"):
            return None

        def make(out):
            raw = out.with_suffix(".raw")
            self.run(voxels, "dissertation", model, raw)
            self.run("zstd", "-q", "-f", "-19", "--single-thread", raw, "-o", out)
            raw.unlink()

        return self.made(self.work / f"{info['content_id']}-dissertation.zst", [voxels], make)

    def zstd_version(self):
        """Version of the libzstd that pbm-build runs with, or "unknown"."""
        for line in self.run("ldd", self.bin / "pbm-build").splitlines():
            if "libzstd" in line and "=> /" in line:
                library = ctypes.CDLL(line.split("=>")[1].split()[0])
                library.ZSTD_versionString.restype = ctypes.c_char_p
                return library.ZSTD_versionString().decode()
        return "unknown"
