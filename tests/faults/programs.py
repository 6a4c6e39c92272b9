#!/usr/bin/env python3
"""Runs the programs while system calls, disks and files fail: programs.py BIN SHIM WORK [--long] [CAMPAIGN...]

BIN is the folder of the programs, SHIM the library of fault_shim.cpp to preload, or "none" if a sanitizer forbids it:
then the campaigns that need it are skipped. Prints a table row per campaign. Exit code 1 if a law is violated.
docs/explanation/reliability.md has the laws.
"""

import errno
import os
import shutil
import signal
import socket
import subprocess
import sys
import time

import disks
import parts
import spilled
from world import OLD, PROGRAMS, Tally, World, judge


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
                world.prepare(program)
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


def vanishing_folders(world, tally):
    """The output folder is moved or removed before the n-th system call."""
    for program in PROGRAMS[:3]:
        calls = world.calls(program)
        for kind in ("move", "remove"):
            for n in world.sample(range(1, len(calls) + 1), 10):
                world.fresh()
                world.prepare(program)
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
            world.prepare(program)
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
            lines = [line for line in said.splitlines() if not line.startswith("pbm-build: note: ")]  # a terabyte needs memory
            tally.require(len(lines) == 1, f"{story}: said {said!r}")
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


CAMPAIGNS = {"calls": each_call_fails, "kill": killed_builds, "folder": vanishing_folders,
             "input": shrinking_inputs, "odd": odd_files, **disks.CAMPAIGNS, **spilled.CAMPAIGNS, **parts.CAMPAIGNS}  # fmt: skip
WITHOUT_SHIM = ("disk", "odd", "parts")


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
