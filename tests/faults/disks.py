"""Disks that are full: of outputs, and of the temporary files of a build."""

import contextlib
import os
import resource
import subprocess

from world import PROGRAMS, SPILLED, judge

PAGE = resource.getpagesize()


@contextlib.contextmanager
def small_disk(folder, tally):
    """Mounts a tmpfs on `folder`; gives a function that sets its size in pages, or None if this user may not mount."""
    folder.mkdir(exist_ok=True)
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "pbm_faults", folder]
    if subprocess.run(mount, stderr=subprocess.DEVNULL).returncode:
        tally.count("no tmpfs: may not mount")
        yield None
        return
    try:
        yield lambda pages: subprocess.run(["mount", "-o", f"remount,size={pages * PAGE}", folder], check=True)
    finally:
        subprocess.run(["umount", folder], check=True)


def pages_of(size):
    return max(1, -(-size // PAGE))


def full_disks(world, tally, programs=PROGRAMS[:3]):
    """The disk is full at every size of the output."""
    for program in programs:
        size = len(world.whole[program])
        for i in world.sample(range(60), 6):
            world.fresh()
            world.prepare(program)
            limit = size * i // 60

            def set_limit(most=limit):
                resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))

            code, said = world.run(world.command(program), limit=set_limit)
            codes = (2, 4) if program in SPILLED else (2,)  # 4: a temporary file is too large
            judge(world, program, code, said, f"{program}, files of {limit} of {size} bytes", tally, codes=codes)
            tally.count("limits of a file's size")
    disk = world.work / "disk"
    out, world.out = world.out, disk
    try:
        with small_disk(disk, tally) as set_pages:
            for program in programs if set_pages else []:
                pages = pages_of(len(world.whole[program]))
                beside = sum(map(pages_of, map(len, world.beside(program).values())))
                sizes = range(0, pages, max(1, pages // 50) if program in SPILLED else 1)
                for i in world.sample(sizes, 4):
                    for entry in disk.iterdir():
                        entry.unlink()
                    # The old file takes one page, and the rest is too small for the new one.
                    set_pages(beside + i + 1)
                    world.prepare(program)
                    code, said = world.run(world.command(program))
                    story = f"{program}, {i} of {pages} pages of disk"
                    judge(world, program, code, said, story, tally, codes=(2,))
                    tally.require(str(disk) in said, f"{story}: {said!r} does not name the folder")
                    tally.count("full tmpfs")
                    if program in SPILLED:
                        set_pages(beside + 2 * pages + 2)
                        code, said = world.run(world.command(program))
                        judge(world, program, code, said, f"after {story}", tally, codes=(0,))
    finally:
        world.out = out


def full_disks_of_parts(world, tally):
    """The same of a spilled build, a part and a merge."""
    world.make_parts()
    full_disks(world, tally, tuple(SPILLED))


def most_used_pages(world, program):
    """Pages of the disk of temporary files that a build uses at most, as seen now and then."""
    world.fresh()
    world.prepare(program)
    process = subprocess.Popen([world.programs / "pbm-build", *map(str, world.command(program)[1:])])
    most = 0
    while process.poll() is None:
        room = os.statvfs(world.temporary)
        most = max(most, (room.f_blocks - room.f_bfree) * room.f_frsize // PAGE)
    return most


def full_temporary_folders(world, tally):
    """The disk of the temporary files is full, at sizes up to the needed one."""
    world.make_parts()
    with small_disk(world.temporary, tally) as set_pages:
        for program in SPILLED if set_pages else []:
            set_pages(1 << 17)
            most = most_used_pages(world, program)
            sizes = 50
            for i in world.sample(range(sizes), 4):
                pages = max(1, most * i // sizes)
                set_pages(pages)
                world.fresh()
                world.prepare(program)
                code, said = world.run(world.command(program))
                story = f"{program}, {pages} of {most} pages of temporary files"
                judge(world, program, code, said, story, tally, codes=(2, 4))
                tally.require(str(world.temporary) in said, f"{story}: {said!r} does not name the folder")
                tally.require(not any(world.temporary.iterdir()), f"{story}: a temporary file is left")
                tally.count("full tmpfs")
                set_pages(1 << 17)
                code, said = world.run(world.command(program))
                judge(world, program, code, said, f"after {story}", tally, codes=(0,))


CAMPAIGNS = {"disk": full_disks, "disk_of_parts": full_disks_of_parts, "disk_of_temporary_files": full_temporary_folders}
