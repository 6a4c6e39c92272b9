"""Builds whose heap lies in temporary files, of a model and of a part, and merges: killed, and with failing calls."""

import errno
import random
import signal
import subprocess
import time

from world import SPILLED, judge

# Errors that fit a call, other calls fail with those of "". An error of sync_file_range that says that pages are lost
# ends the build; everything else that only makes memory smaller is harmless.
ERRORS = {"": ("EIO", "ENOSPC", "ENOMEM", "EINTR"), "mmap": ("ENOMEM",), "posix_fallocate": ("EIO", "ENOSPC", "EINTR"),
          "fallocate": ("EIO", "EOPNOTSUPP"), "madvise": ("EIO", "ENOMEM"),
          "sync_file_range": ("EIO", "ENOSPC", "EINTR", "ENOMEM")}  # fmt: skip
HARMLESS = ("fallocate", "madvise", "sync_file_range")  # fallocate: of a freed block
LOST = ("EIO", "ENOSPC")


def nothing_is_left(world, story, tally):
    tally.require(not any(world.temporary.iterdir()), f"{story}: a temporary file has a name")


def whole_run(world, program, story, tally):
    """Returns how long it took, in seconds."""
    begin = time.monotonic()
    code, said = world.run(world.command(program))
    judge(world, program, code, said, story, tally, codes=(0,))
    return time.monotonic() - begin


def killed(world, tally):
    """kill -9 at random moments; the next run always succeeds."""
    world.make_parts()
    moments = random.Random(1)
    for program in SPILLED:
        command = world.command(program)
        world.fresh()
        world.prepare(program)
        whole = whole_run(world, program, program, tally)
        kills, wanted = 0, 67 if world.complete else 7
        for i in range(2 * wanted):  # some builds end before they are killed
            if kills == wanted:
                break
            world.fresh()
            world.prepare(program)
            process = subprocess.Popen([world.programs / command[0], *map(str, command[1:])], stdin=subprocess.DEVNULL)
            part = moments.random()
            time.sleep(whole * part)
            story = f"{program} {i}, killed after {part:.3f} of its time"
            nothing_is_left(world, story, tally)
            process.send_signal(signal.SIGKILL)
            code = process.wait()
            kills += code != 0
            judge(world, program, code, "", story, tally, codes=(-9, 0), stale=1)
            nothing_is_left(world, story, tally)
            whole = whole_run(world, program, f"after {story}", tally)


def faults_of(call, count):
    """(Number of the call, kind, error): of many calls some, as their number varies between runs."""
    numbers = range(1, count + 1) if count <= 40 else [1, 2, 3, *range(4, count // 2, max(1, count // 12))]
    kinds = ("error", "errors") if call in HARMLESS else ("error",)
    faults = [(n, kind, error) for n in numbers for kind in kinds for error in ERRORS.get(call, ERRORS[""])]
    return faults + [(n, "kill", "") for n in numbers if call not in HARMLESS]


def codes_of(call, error):
    if call == "sync_file_range" and error in LOST:
        return (2,)
    if call in HARMLESS or (error == "EINTR" and call in ("posix_fallocate", "read", "write", "pwrite", "fsync")):
        return (0,)
    return (0, 4) if call == "posix_fallocate" else (0, 2, 4)


def each_call_fails(world, tally):
    """The n-th call of a name fails, for many n; or that call and all later ones; or the program is killed at it."""
    world.make_parts()
    chosen = random.Random(1)
    for program in SPILLED:
        made = world.calls(program)
        tally.require("posix_fallocate" in made, f"{program}: makes no temporary files")
        for call in sorted({*made, *HARMLESS}):
            # The calls of the heap's own thread are counted by name only.
            faults = faults_of(call, made.count(call) or len(world.calls(program, {"CALL": call})))
            for n, kind, error in faults if world.complete else chosen.sample(faults, min(len(faults), 2)):
                call_fails(world, program, {"CALL": call, "AT": n, "KIND": kind}, error, tally)


def call_fails(world, program, fault, error, tally):
    world.fresh()
    world.prepare(program)
    log = world.work / "calls"
    log.unlink(missing_ok=True)
    number = getattr(errno, error) if error else 0
    code, said = world.run(world.command(program), {**fault, "ERRNO": number, "LOG": log})
    if not log.exists() or len(log.read_text().split()) < fault["AT"]:  # the number of calls varies between runs
        return
    killed = fault["KIND"] == "kill"
    story = f"{program}, call {fault['AT']} of {fault['CALL']}: {fault['KIND']} {error}"
    codes = (-9,) if killed else codes_of(fault["CALL"], error)
    judge(world, program, code, said, story, tally, codes=codes, stale=1 if killed or codes == (2,) else 0)
    nothing_is_left(world, story, tally)
    if code and fault["CALL"] in ("posix_fallocate", "sync_file_range") and not killed:
        tally.require(str(world.temporary) in said, f"{story}: {said!r} does not name the folder")


CAMPAIGNS = {"kill_spilled": killed, "calls_of_spilled": each_call_fails}
