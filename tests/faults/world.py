"""What the campaigns of programs.py share: programs with inputs and outputs, and the laws of every run."""

import os
import pathlib
import shutil
import subprocess

HANG = 300  # time limit of a program, seconds
PROGRAMS = ("pbm-build", "pbm-export", "pbm-render", "pbm-validate")
# Builds of a larger scan, most of whose heap lies in temporary files: how many bytes of --max-memory make it so.
SPILLED = {"spilled": "12M", "shard": "4M", "merge": "10M"}
PARTS = 3
OLD = b"what stood here before"


def part_name(number):
    return f"model.pbvg.part-{number}-of-{PARTS}"


class Tally:
    """Result of a campaign."""

    def __init__(self):
        self.cases = self.detected = self.broken = 0
        self.notes = {}

    def require(self, law, what):
        if not law:
            self.broken += 1
            if self.broken <= 20:
                print("BROKEN:", what, flush=True)
        return law

    def count(self, what):
        self.notes[what] = self.notes.get(what, 0) + 1

    def row(self, name, seconds):
        notes = "; ".join(f"{number} {what}" for what, number in sorted(self.notes.items()))
        return f"| {name} | {self.cases} | {self.detected} | {self.broken} | {notes}; {seconds:.1f} s |"


def hills(edge):
    """A mesh of edge x edge coloured vertices, as PLY."""
    rows = [f"{x} {y} {x * y % 7 / 2} {x * 255 // edge} {y * 255 // edge} 90" for y in range(edge) for x in range(edge)]
    faces = [f"3 {at} {at + 1} {at + edge}" for at in range(edge * (edge - 1)) if at % edge < edge - 1]
    axes = [f"property float {name}" for name in "xyz"] + [f"property uchar {name}" for name in ("red", "green", "blue")]
    header = ["ply", "format ascii 1.0", f"element vertex {len(rows)}", *axes]
    return "\n".join([*header, f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header",
                      *rows, *faces, ""])  # fmt: skip


class World:
    """All programs with their inputs and expected outputs."""

    def __init__(self, programs, shim, work, complete):
        self.programs, self.shim, self.work, self.complete = pathlib.Path(programs), shim, pathlib.Path(work), complete
        shutil.rmtree(self.work, ignore_errors=True)
        self.work.mkdir(parents=True)
        self.out = self.work / "out"
        self.temporary = self.work / "temporary"
        self.scan, self.model, self.large_scan = (self.work / name for name in ("scan.ply", "model.pbvg", "large.ply"))
        self.scan.write_text(hills(100 if complete else 30))
        self.must("pbm-build", self.scan, "-o", self.model, "-q", "-j", 1)
        self.whole = {}  # output of each command when nothing fails
        for program in PROGRAMS:
            self.fresh()
            self.must(*self.command(program))
            self.whole[program] = self.output(program).read_bytes() if program != "pbm-validate" else b""
        self.parts = {}  # name -> bytes; see make_parts

    def must(self, program, *arguments):
        subprocess.run([self.programs / program, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL, timeout=600)

    def fresh(self):
        """Makes an empty output folder."""
        for folder in (self.out, self.work / "moved"):
            shutil.rmtree(folder, ignore_errors=True)
        self.out.mkdir()

    def prepare(self, program):
        """Puts an old output, and the parts that a merge reads, into the output folder."""
        for name, content in self.beside(program).items():
            (self.out / name).write_bytes(content)
        if program != "pbm-validate":
            self.output(program).write_bytes(OLD)

    def beside(self, program):
        """Files of the output folder that a run reads and leaves as they are: name -> bytes."""
        return self.parts if program == "merge" else {}

    def output(self, program):
        names = {"pbm-export": "points.ply", "pbm-render": "picture.png", "shard": part_name(1)}
        return self.out / names.get(program, "model.pbvg")

    def make_parts(self):
        """Makes what the builds of SPILLED read, and their expected outputs, unless they are there."""
        if self.parts:
            return
        self.temporary.mkdir()
        self.large_scan.write_text(hills(140))
        self.fresh()
        for part in range(PARTS):
            self.must(*self.large_build("--shard", f"{part}/{PARTS}"))
        self.parts = {part_name(part): (self.out / part_name(part)).read_bytes() for part in range(PARTS)}
        self.must(*self.large_build())
        self.whole.update({program: (self.out / "model.pbvg").read_bytes() for program in SPILLED})
        self.whole["shard"] = self.parts[part_name(1)]

    def large_build(self, *more, scan=None, folder=None, depth=9):
        """Of a given depth: a build that chooses its depth takes several times as long."""
        output = (folder or self.out) / "model.pbvg"
        return ["pbm-build", scan or self.large_scan, "-o", output, "-q", "-j", 1, "--depth", depth, *more]

    def command(self, program):
        if program in SPILLED:
            more = {"spilled": [], "shard": ["--shard", f"1/{PARTS}"], "merge": ["--merge", PARTS]}[program]
            return self.large_build("--max-memory", SPILLED[program], "--temp-dir", self.temporary, *more)
        if program == "pbm-build":
            return [program, self.scan, "-o", self.output(program), "-q", "-j", 1]
        if program == "pbm-export":
            return [program, self.model, "-o", self.output(program), "-q", "-j", 1]
        if program == "pbm-render":
            return [program, self.model, "-o", self.output(program), "-q", "-j", 1, "--resolution", "80,60"]
        return [program, self.model, "-j", 1]

    def run(self, command, fault=None, limit=None):
        """Returns the exit code (negative: signal) and standard error."""
        environment = dict(os.environ, **{f"PBM_FAULT_{key}": str(value) for key, value in (fault or {}).items()})
        if fault is not None:
            environment["LD_PRELOAD"] = self.shim
        try:
            done = subprocess.run(
                [self.programs / command[0], *map(str, command[1:])],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                timeout=HANG,
                preexec_fn=limit,
            )
        except subprocess.TimeoutExpired:
            return "hangs", ""
        said = done.stderr
        if command[0] == "pbm-validate" and done.returncode > 0 and not said:  # findings go to standard output
            said = done.stdout.splitlines(True)[0] if done.stdout else b""
        return done.returncode, said.decode(errors="replace")

    def calls(self, program, fault=None):
        """Names of the system calls of a run in which nothing fails."""
        self.fresh()
        self.prepare(program)
        log = self.work / "calls"
        log.unlink(missing_ok=True)
        code, said = self.run(self.command(program), {"LOG": log, **(fault or {})})
        assert code == 0, said
        return log.read_text().split() if log.exists() else []

    def sample(self, numbers, most):
        """All numbers with --long, else about `most` of them, evenly spaced."""
        numbers = list(numbers)
        return numbers if self.complete else numbers[:: max(1, len(numbers) // most)]


def judge(world, program, code, said, story, tally, folder=None, codes=(0, 2, 4), stale=0):
    """Laws of every run: exit code, messages, remaining files."""
    tally.cases += 1
    tally.require(code in codes, f"{story}: exit code {code}, said {said!r}")
    lines = 0 if code in (0, -9, "hangs") else 1
    tally.require(said.count("\n") == lines, f"{story}: exit code {code}, said {said!r}")
    tally.detected += code != 0
    tally.count(f"exit code {code}")
    if program == "pbm-validate":
        return
    folder = folder or world.out
    names = sorted(entry.name for entry in folder.iterdir()) if folder.exists() else []
    name = world.output(program).name
    beside = world.beside(program)
    left = [other for other in names if other != name and other not in beside]
    for other, content in beside.items():
        tally.require((folder / other).read_bytes() == content, f"{story}: {other} has changed")
    tally.require(len(left) <= stale and all(other.startswith(name + ".pbm-") for other in left), f"{story}: left {left}")
    if not folder.exists():
        return
    bytes_there = (folder / name).read_bytes() if name in names else None
    new = bytes_there == world.whole[program]
    tally.require(new or bytes_there == OLD, f"{story}: neither the old nor the new file")
    tally.require(new or code != 0, f"{story}: exit code 0, and the old file")
