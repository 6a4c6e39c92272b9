#!/usr/bin/env python3
"""Runs the programs while system calls, disks and files fail: programs.py BIN SHIM WORK [--long] [CAMPAIGN...]

BIN is the folder of the programs, SHIM the library of fault_shim.cpp to preload, or "none" if a sanitizer forbids it:
then the campaigns that need it are skipped. Prints a table row per campaign. Exit code 1 if a law is violated.
docs/explanation/reliability.md has the laws.
"""

import errno
import os
import pathlib
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time

HANG = 60  # time limit of a program, seconds
PROGRAMS = ("pbm-build", "pbm-export", "pbm-render", "pbm-validate")


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
        self.scan, self.model = self.work / "scan.ply", self.work / "model.pbvg"
        self.scan.write_text(hills(100 if complete else 30))
        self.must("pbm-build", self.scan, "-o", self.model, "-q", "-j", 1)
        self.whole = {}  # output of each command when nothing fails
        for program in PROGRAMS:
            self.fresh()
            self.must(*self.command(program))
            self.whole[program] = self.output(program).read_bytes() if program != "pbm-validate" else b""

    def must(self, program, *arguments):
        subprocess.run([self.programs / program, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL, timeout=600)

    def fresh(self):
        """Makes an output folder with an old file for each program."""
        for folder in (self.out, self.work / "moved"):
            shutil.rmtree(folder, ignore_errors=True)
        self.out.mkdir()

    def output(self, program):
        return self.out / {"pbm-build": "model.pbvg", "pbm-export": "points.ply", "pbm-render": "picture.png"}[program]

    def command(self, program):
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

    def calls(self, program):
        """Names of the system calls of a run in which nothing fails."""
        self.fresh()
        log = self.work / "calls"
        log.unlink(missing_ok=True)
        code, said = self.run(self.command(program), {"LOG": log})
        assert code == 0, said
        return log.read_text().split()

    def sample(self, numbers, most):
        """All numbers with --long, else about `most` of them, evenly spaced."""
        numbers = list(numbers)
        return numbers if self.complete else numbers[:: max(1, len(numbers) // most)]


OLD = b"what stood here before"


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
    left = [other for other in names if other != name]
    tally.require(len(left) <= stale and all(other.startswith(name + ".pbm-") for other in left), f"{story}: left {left}")
    if not folder.exists():
        return
    bytes_there = (folder / name).read_bytes() if name in names else None
    new = bytes_there == world.whole[program]
    tally.require(new or bytes_there == OLD, f"{story}: neither the old nor the new file")
    tally.require(new or code != 0, f"{story}: exit code 0, and the old file")


def each_call_fails(world, tally):
    """The n-th system call fails, for all n."""
    kinds = [("EIO", {"KIND": "error", "ERRNO": errno.EIO}), ("ENOSPC", {"KIND": "error", "ERRNO": errno.ENOSPC}),
             ("EINTR", {"KIND": "error", "ERRNO": errno.EINTR}), ("ENOMEM", {"KIND": "error", "ERRNO": errno.ENOMEM}),
             ("half of it", {"KIND": "short"})]  # fmt: skip
    for program in PROGRAMS:
        calls = world.calls(program)
        tally.notes[f"calls of {program}"] = len(calls)
        for name, fault in kinds:
            moves = {"half of it": ("read", "write", "pwrite")}.get(name)
            numbers = [n for n, call in enumerate(calls, 1) if moves is None or call in moves]
            for n in world.sample(numbers, 6):
                world.fresh()
                if program != "pbm-validate":
                    world.output(program).write_bytes(OLD)
                log = world.work / "calls"
                log.unlink(missing_ok=True)
                code, said = world.run(world.command(program), {**fault, "AT": n, "LOG": log})
                made = log.read_text().split()
                if len(made) < n:  # the number of calls varies between runs
                    continue
                story = f"{program}, call {n} ({made[n - 1]}): {name}"
                judge(world, program, code, said, story, tally)
                if name in ("half of it", "EINTR") and made[n - 1] in ("read", "write", "pwrite", "fsync"):
                    tally.require(code == 0, f"{story}: exit code {code}, {said!r}")


def killed_builds(world, tally):
    """kill -9 at each system call of a build, and at regular times."""
    command = world.command("pbm-build")
    output = world.output("pbm-build")
    calls = world.calls("pbm-build")
    world.fresh()
    output.write_bytes(OLD)
    for n in world.sample(range(1, len(calls) + 1), 20):
        code, _ = world.run(command, {"KIND": "kill", "AT": n})
        judge(world, "pbm-build", code, "", f"killed at call {n} ({calls[n - 1]})", tally, codes=(-9, 0), stale=1)
        output.write_bytes(OLD)
    begin = time.monotonic()
    world.must(*command)
    whole = time.monotonic() - begin
    moments = 300 if world.complete else 10
    for i in range(moments):
        output.write_bytes(OLD)
        process = subprocess.Popen([world.programs / command[0], *map(str, command[1:])], stdin=subprocess.DEVNULL)
        time.sleep(whole * 1.05 * i / moments)
        process.send_signal(signal.SIGKILL)
        judge(world, "pbm-build", process.wait(), "", f"killed after {i}/{moments}", tally, codes=(-9, 0), stale=1)
    for left in ("model.pbvg.pbm-1", "model.pbvg.pbm-2"):  # leftovers as of the last killed build
        (world.out / left).write_bytes(b"the half of a model")
    code, said = world.run(command)
    judge(world, "pbm-build", code, said, "the build after killed ones", tally, codes=(0,))


def full_disks(world, tally):
    """The disk is full at every size of the output."""
    disk = world.work / "disk"
    disk.mkdir()
    for program in PROGRAMS[:3]:
        size = len(world.whole[program])
        for i in world.sample(range(60), 6):
            world.fresh()
            world.output(program).write_bytes(OLD)
            limit = size * i // 60

            def set_limit(most=limit):
                resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))

            code, said = world.run(world.command(program), limit=set_limit)
            judge(world, program, code, said, f"{program}, files of {limit} of {size} bytes", tally, codes=(2,))
            tally.count("limits of a file's size")
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "pbm_faults", disk], stderr=subprocess.DEVNULL).returncode:
        tally.count("no tmpfs: may not mount")
        return
    out, world.out = world.out, disk
    try:
        for program in PROGRAMS[:3]:
            size, page = len(world.whole[program]), resource.getpagesize()
            pages = -(-size // page)
            for i in world.sample(range(max(pages, 1)), 4):
                for entry in disk.iterdir():
                    entry.unlink()
                # The old file takes one page, and the rest is too small for the new one.
                subprocess.run(["mount", "-o", f"remount,size={(i + 1) * page}", disk], check=True)
                world.output(program).write_bytes(OLD)
                code, said = world.run(world.command(program))
                judge(world, program, code, said, f"{program}, {i} of {pages} pages of disk", tally, folder=disk, codes=(2,))
                tally.count("full tmpfs")
    finally:
        world.out = out
        subprocess.run(["umount", disk], check=True)


def vanishing_folders(world, tally):
    """The output folder is moved or removed before the n-th system call."""
    for program in PROGRAMS[:3]:
        calls = world.calls(program)
        for kind in ("move", "remove"):
            for n in world.sample(range(1, len(calls) + 1), 10):
                world.fresh()
                world.output(program).write_bytes(OLD)
                moved = world.work / "moved"
                fault = {"KIND": kind, "PATH": world.out, "TO": moved, "AT": n}
                code, said = world.run(world.command(program), fault)
                story = f"{program}, folder {kind}d before call {n} ({calls[n - 1]})"
                judge(world, program, code, said, story, tally, folder=moved if kind == "move" else world.out, codes=(0, 2))


def shrinking_inputs(world, tally):
    """The mapped input becomes empty before the n-th system call."""
    for program in PROGRAMS:
        calls = world.calls(program)
        source = world.scan if program == "pbm-build" else world.model
        whole = source.read_bytes()
        for n in world.sample(range(1, len(calls) + 1), 10):
            world.fresh()
            if program != "pbm-validate":
                world.output(program).write_bytes(OLD)
            code, said = world.run(world.command(program), {"KIND": "empty", "PATH": source, "AT": n})
            source.write_bytes(whole)
            tally.require("became shorter" not in said or str(source) in said, f"{program}: {said!r} does not name {source}")
            # Exit code 3: the input was empty before it was mapped.
            # A process that ends in a signal handler cannot remove its temporary file; the next run does.
            judge(world, program, code, said, f"{program}, input emptied before call {n} ({calls[n - 1]})", tally,
                  codes=(0, 2, 3), stale=1)


def odd_files(world, tally):
    """Paths that are not regular files: every program prints one line without delay."""
    odd = world.work / "odd"
    odd.mkdir()
    os.mkfifo(odd / "pipe")
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(str(odd / "socket"))
    with open(odd / "terabyte.pbvg", "wb") as file:
        file.truncate(1 << 40)
    os.link(odd / "terabyte.pbvg", odd / "terabyte.ply")
    (odd / "empty").write_bytes(b"")
    (odd / "loop").symlink_to("loop")
    (odd / "a folder").mkdir()
    inputs = {"a folder": (2,), "pipe": (2, 3), "socket": (2,), "terabyte.pbvg": (3, 5), "terabyte.ply": (3,), "empty": (3,),
              "loop": (2,), "nothing": (2,), "/dev/zero": (2, 3, 4), "/dev/null": (2, 3), "/proc/self/maps": (2, 3),
              "/proc/self/mem": (2, 3), "/proc/self/pagemap": (2, 3), "/": (2,)}  # fmt: skip
    programs = {"pbm-build": ["-o", world.out / "x.pbvg"], "pbm-export": ["-o", world.out / "x.ply"],
                "pbm-render": ["-o", world.out / "x.png"], "pbm-validate": [], "pbm-info": []}  # fmt: skip
    world.fresh()
    for name, codes in inputs.items():
        path = name if name.startswith("/") else odd / name
        for program, more in programs.items():
            if program == "pbm-build" and name == "pipe":  # a reader of a pipe waits for a writer
                subprocess.Popen(["sh", "-c", 'echo no scan >"$0"', path])
            begin = time.monotonic()
            code, said = world.run([program, path, *more])
            seconds = time.monotonic() - begin
            story = f"{program} {name}"
            tally.cases += 1
            tally.detected += code != 0
            tally.require(code in codes, f"{story}: exit code {code}, said {said!r}")
            tally.require(said.count("\n") == 1, f"{story}: said {said!r}")
            tally.require(seconds < 10, f"{story}: took {seconds:.1f} s")
            tally.require(not any(world.out.iterdir()), f"{story}: left something")
    listener.close()
    for name, codes in {"a folder": (2,), "socket": (2,), "loop": (2,), "/dev/full": (2,), "/dev/null": (0,), "no/folder": (2,),
                        "/proc/version": (2,)}.items():  # fmt: skip
        path = name if name.startswith("/") else odd / name
        for program in PROGRAMS[:3]:
            command = world.command(program)
            command[command.index("-o") + 1] = path
            code, said = world.run(command)
            if program == "pbm-render" and code == 1:  # the suffix of a picture must name its format
                continue
            tally.cases += 1
            tally.detected += code != 0
            tally.require(code in codes and said.count("\n") == (code != 0), f"{program} -o {name}: {code}, said {said!r}")


CAMPAIGNS = {"calls": each_call_fails, "kill": killed_builds, "disk": full_disks, "folder": vanishing_folders,
             "input": shrinking_inputs, "odd": odd_files}  # fmt: skip
WITHOUT_SHIM = ("disk", "odd")


def main():
    names = [argument for argument in sys.argv[1:] if argument != "--long"]
    world = World(*names[:3], "--long" in sys.argv)
    broken = 0
    for name in names[3:] or CAMPAIGNS:
        if world.shim == "none" and name not in WITHOUT_SHIM:
            continue
        tally, begin = Tally(), time.monotonic()
        CAMPAIGNS[name](world, tally)
        print(tally.row(name, time.monotonic() - begin), flush=True)
        broken += tally.broken
    shutil.rmtree(world.work)
    return 1 if broken else 0


sys.exit(main())
