#!/usr/bin/env python3
"""Tests how pbm-view opens files, on a virtual display: opening_test.py, arguments as window_test.py.

Start page, several files and folders, open dialog, scans that are built first, files that are replaced, damage.
"""

import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

import window_test
import x11
from window_test import (View, check, check_same, check_same_in_the_end, environment, hold, programs, rendered, run,
                         wait_for_status, work)


def folder(name):
    path = work / name
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir(parents=True)
    return path


def program(path, script):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n" + script)
    path.chmod(0o755)


def title(view):
    return view.xdotool("getwindowname", view.window).strip()


def wait_for_title(view, start):
    view.wait(lambda: title(view).startswith(start), f"window of {start}")
    view.settle(0)


def is_alive(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return "State:\tZ" not in pathlib.Path(f"/proc/{process}/status").read_text()


def changes(view, before):
    """Waits until the window shows something else."""
    view.wait(lambda: view.grab() != before, "other picture")


def test_several_files(display):
    files = folder("files")
    for name in ("b-2.pbvg", "b-10.pbvg"):
        shutil.copy(work / "model.pbvg", files / name)
    shutil.copy(work / "other.pbvg", files / "a.pbvg")
    desktop = x11.Desktop(display)
    # A file has its folder as neighbours, in the order of numbers, round at the ends.
    with View(display, "files/b-2.pbvg") as view:
        check(title(view).startswith("b-2.pbvg - "), title(view))
        for key, name in (("Next", "b-10.pbvg (3 of 3)"), ("Next", "a.pbvg (1 of 3)"), ("Prior", "b-10.pbvg (3 of 3)")):
            view.xdotool("key", key)
            wait_for_title(view, name)
        view.key("Prior")
        view.key("Prior")
        wait_for_title(view, "a.pbvg (1 of 3)")
        check_same_in_the_end(view, "other.pbvg", "a neighbour")
        # Dropped files are gone through too.
        desktop.drop(view.window, (work / "model.pbvg").as_uri(), (work / "other.pbvg").as_uri())
        wait_for_title(view, "model.pbvg (1 of 2)")
        view.xdotool("key", "Next")
        wait_for_title(view, "other.pbvg (2 of 2)")
        desktop.drop(view.window, files.as_uri())
        wait_for_title(view, "a.pbvg (1 of 3)")
        check(view.quit() == 0, "Escape does not end with 0")
    with View(display, "files") as view:
        wait_for_title(view, "a.pbvg (1 of 3)")
        check(view.quit() == 0, "Escape does not end with 0")
    with View(display, "model.pbvg", "files", "none.pbvg") as view:
        wait_for_title(view, "model.pbvg (1 of 5)")
        # A file that cannot be shown is told, and the keys go on.
        shown = view.grab()
        view.xdotool("key", "Prior")
        changes(view, shown)
        check(len(view.lines("pbm-view: none.pbvg: cannot open")) == 1, view.text())
        view.xdotool("key", "Prior")
        wait_for_title(view, "b-10.pbvg (4 of 5)")
        check(view.quit() == 0, "Escape does not end with 0")
    empty = folder("empty")
    result = run("pbm-view", "empty")
    check(result.returncode == 2 and "has no model" in result.stderr and result.stderr.count("\n") == 1, f"{result}")
    result = run("pbm-view", "--turntable=a.avi", "model.pbvg", "other.pbvg", display=display)
    check(result.returncode == 1 and not (work / "a.avi").exists(), f"{result}")
    empty.rmdir()


def test_start_page(display):
    """Without a file: the sample, and a page of recent files for keyboard and mouse."""
    state = {"XDG_STATE_HOME": str(folder("start"))}
    (folder("start/pbm") / "started").touch()  # no hint of a first start
    sample = programs / ".." / "share" / "pbm" / "sample.pbvg"
    with View(display, **state) as view:
        with_page = view.grab()
        view.next_frame("key", "Escape")
        check(view.grab() != with_page, "there is no start page")
        check_same(view, sample, "the sample")
        check(view.quit() == 0, "Escape does not end with 0")
    check(not (work / "start" / "pbm" / "recent").exists(), "the sample is a recent file")
    for name in ("other.pbvg", "model.pbvg"):
        with View(display, name, **state) as view:
            check(view.quit() == 0, "Escape does not end with 0")
    check((work / "start/pbm/recent").read_text() == f"{work}/model.pbvg\n{work}/other.pbvg\n", "not the recent files")
    with View(display, **state) as view:
        view.xdotool("key", "Down")
        view.xdotool("key", "Down")
        view.xdotool("key", "Return")
        wait_for_title(view, "other.pbvg - ")
        check_same_in_the_end(view, "other.pbvg", "a recent file")
        view.next_frame("key", "ctrl+r")
        # The rows of the page, from the lower edge of the window upwards.
        for y in range(window_test.SIZE[1] - 20, 0, -10):
            view.xdotool("mousemove", 100, y, "sleep", "0.05", "click", 1)
            if "model.pbvg" in title(view):
                break
        wait_for_title(view, "model.pbvg - ")
        check(view.quit() == 0, "Escape does not end with 0")
    # Without a sample the page is all there is.
    elsewhere = folder("elsewhere/bin")
    shutil.copy(programs / "pbm-view", elsewhere)
    with View(display, loading=True, program=elsewhere / "pbm-view", **state) as view:
        check(len(set(view.grab()[2])) > 10, "there is no start page")
        view.xdotool("key", "Up")
        view.xdotool("key", "Return")
        wait_for_title(view, "other.pbvg - ")
        check(view.quit() == 0, "Escape does not end with 0")
    with View(display, loading=True, program=elsewhere / "pbm-view", **state) as view:
        check(view.quit() == 0, "Escape does not end with 0")


def test_open_dialog(display):
    tools = folder("tools")
    path = {"PATH": str(tools)}
    with View(display, "model.pbvg", **path) as view:
        shown = view.grab()
        view.xdotool("key", "ctrl+o")
        changes(view, shown)
        check(len(view.lines("pbm-view: no open dialog is installed (zenity or kdialog)")) == 1, view.text())
        program(tools / "zenity", f"echo $@ >'{work}/asked'; echo '{work}/other.pbvg'; echo '{work}/model.pbvg'")
        view.xdotool("key", "ctrl+o")
        wait_for_title(view, "other.pbvg (1 of 2)")
        check("--file-selection --multiple" in (work / "asked").read_text(), "zenity was asked for something else")
        program(tools / "zenity", "exit 1")  # closed
        view.xdotool("key", "ctrl+o")
        time.sleep(0.3)
        check(title(view).startswith("other.pbvg (1 of 2)") and view.text().count("pbm-view: ") == 1, view.text())
        # The dialog ends with the window.
        program(tools / "zenity", f"echo $$ >'{work}/dialog'; exec /bin/sleep 1000")
        view.xdotool("key", "ctrl+o")
        view.wait(lambda: (work / "dialog").exists() and (work / "dialog").read_text(), "dialog")
        check(view.quit() == 0, "Escape does not end with 0")
        check(not is_alive(int((work / "dialog").read_text())), "the dialog is left")


def test_scan(display):
    """A scan is built into the cache, shown, and taken from there the next time."""
    check(run("pbm-build", "-q", "scan.ply", "-o", "built.pbvg").returncode == 0, "pbm-build")
    cache = {"PBM_CACHE": str(folder("scans"))}
    for _ in range(2):
        with View(display, "scan.ply", **cache) as view:
            check(title(view).startswith("scan.ply"), title(view))
            check_same(view, "built.pbvg", "a scan")
            check(len(list((work / "scans").iterdir())) == 1, "not one model in the cache")
            view.xdotool("key", "space")
            view.wait(lambda: view.lines("saved scan-"), "picture with the name of the scan")
            check(view.quit() == 0, "Escape does not end with 0")
    # Another program uses the model: the window does not take it for overwritten.
    with View(display, "scan.ply", **cache) as view:
        check(run("pbm-render", "-q", "--resolution=64,48", "-o", "used.png", "scan.ply", **cache).returncode == 0, "pbm-render")
        before = len(view.text())
        view.key("Left")
        check_same_in_the_end(view, "built.pbvg", "a model that another program uses")
        check("no picture yet" not in view.text()[before:], "the window opens its model again")
        check(view.quit() == 0, "Escape does not end with 0")
    with View(display, "--cache=scan.ply/cache", "scan.ply", **cache) as view:
        check_same_in_the_end(view, "built.pbvg", "a scan whose cache cannot be made")  # once its notice is gone
        check(view.text().count("pbm-view: warning: the cache is not used: scan.ply/cache: ") == 1, view.text())
        check(view.quit() == 0, "Escape does not end with 0")
    before = (work / "scans").stat().st_mtime_ns
    with View(display, "--cache=none", "scan.ply", **cache, TMPDIR=str(folder("temporary"))) as view:
        check_same(view, "built.pbvg", "a scan without cache")
        check(not list((work / "temporary").iterdir()), "the temporary model is left")
        check(view.quit() == 0, "Escape does not end with 0")
    check((work / "scans").stat().st_mtime_ns == before, "--cache=none uses the cache")
    result = run("pbm-view", "--turntable=scan.avi", "--resolution=160,120", "--frames=3", "scan.ply", display=display,
                 **cache)
    check(result.returncode == 0 and not result.stderr, f"{result}")
    check(run("pbm-render", "-q", "--turntable=built.avi", "--resolution=160,120", "--frames=3",
              "built.pbvg").returncode == 0, "pbm-render")
    check((work / "scan.avi").read_bytes() == (work / "built.avi").read_bytes(), "the video is another one")


def test_build_is_cancelled(display):
    """While a scan is built the window shows its progress; Escape, another file and the end of the window end it."""
    mine, started = folder("mine/bin"), work / "started"
    shutil.copy(programs / "pbm-view", mine)
    program(mine / "pbm-build", f"echo $$ >'{started}'; echo 40 sample points; exec /bin/sleep 1000")
    for action in ("Escape", "close", "drop", "Escape with a model", "kill"):
        started.unlink(missing_ok=True)
        files = ("model.pbvg",) if action == "Escape with a model" else ("scan.ply",)
        with View(display, *files, loading=files == ("scan.ply",), program=mine / "pbm-view") as view:
            if action == "Escape with a model":
                shown = view.grab()
                x11.Desktop(display).drop(view.window, (work / "scan.ply").as_uri())
            view.wait(lambda: started.exists() and started.read_text(), "build")
            building, frames = int(started.read_text()), len(view.lines("frame "))
            view.wait(lambda: b"\xff\xcd\x78" in view.grab()[2], "bar of progress")
            check(not view.lines("view: ") or action == "Escape with a model", "there is a view before a model")
            if action == "Escape":
                view.next_frame("key", "Escape")
                view.wait(lambda: not is_alive(building), "end of the build")
                check(view.quit() == 0 and not view.lines("pbm-view: "), view.text())
            elif action == "close":
                x11.Desktop(display).close(view.window)
                check(view.process.wait(window_test.PATIENCE) == 0, "the close button does not end with 0")
            elif action == "drop":
                x11.Desktop(display).drop(view.window, (work / "model.pbvg").as_uri())
                wait_for_title(view, "model.pbvg")
                check(view.quit() == 0, "Escape does not end with 0")
            elif action == "Escape with a model":
                view.xdotool("key", "Escape")
                check_same_in_the_end(view, "model.pbvg", "the model before the scan")
                check(view.quit() == 0, "Escape does not end with 0")
            else:
                check(frames > 0, "no frame")
                view.process.send_signal(signal.SIGKILL)
                view.process.wait(window_test.PATIENCE)
                continue  # the script does not write: pbm-build itself is tested below
            check(not is_alive(building), f"{action}: the build goes on")
    # pbm-build ends when nobody reads its progress.
    result = subprocess.run(f"'{programs}/pbm-build' -q --progress large.ply -o unread.pbvg | true; echo ${{PIPESTATUS[0]}}",
                            shell=True, executable="/bin/bash", cwd=work, capture_output=True, text=True, timeout=300)
    check(result.stdout == "2\n" and not (work / "unread.pbvg").exists(), f"{result}")


def test_errors_in_words(display):
    """What is wrong with the first file is told in the window; its details open by keyboard; the next file is shown."""
    good = (work / "model.pbvg").read_bytes()
    (work / "short.pbvg").write_bytes(good[:1000])
    with View(display, "short.pbvg", loading=True) as view:
        told = view.grab()
        pixels = list(zip(*[iter(told[2])] * 3))
        check(sum(min(p) > 200 for p in pixels) > 300, "the window says nothing")
        check(any(r > 200 and g < 170 and b < 150 for r, g, b in pixels), "the name of the file does not stand out")
        view.xdotool("key", "Up")
        view.next_frame("key", "Return")
        changes(view, told)
        detailed = view.grab()
        check(sum(min(p) > 200 for p in zip(*[iter(detailed[2])] * 3)) > sum(min(p) > 200 for p in pixels) + 200,
              "there are no details")
        x11.Desktop(display).drop(view.window, (work / "model.pbvg").as_uri())
        wait_for_title(view, "model.pbvg")
        check_same_in_the_end(view, "model.pbvg", "the next file")
        check(view.quit() == 0, "a model was shown, and the exit code is not 0")


def chunks_of_finest_level(model):
    """Offset and size of the section of type 17 with the highest level. BVG.md 3.2"""
    data = model.read_bytes()
    table, count = (int.from_bytes(data[at : at + size], "little") for at, size in ((24, 8), (32, 4)))
    entries = [data[table + 64 * i : table + 64 * (i + 1)] for i in range(count)]
    _, finest = max((int.from_bytes(e[8:12], "little"), e) for e in entries if int.from_bytes(e[0:4], "little") == 17)
    return int.from_bytes(finest[24:32], "little"), int.from_bytes(finest[32:40], "little")


def test_damage_out_of_view(display):
    """A damaged chunk is told although no picture shows it."""
    data = bytearray((work / "large.pbvg").read_bytes())
    offset, size = chunks_of_finest_level(work / "large.pbvg")
    check(offset + size <= len(data) and size > 100000, f"chunks at {offset}, {size} bytes")
    data[offset + size - 1000] ^= 1
    (work / "hidden.pbvg").write_bytes(data)
    # Few voxels are enough for a small picture: the finest level is not needed.
    with View(display, "hidden.pbvg", size=(64, 48)) as view:
        view.wait(lambda: view.lines("pbm-view: hidden.pbvg: 5.6.4"), "word about the damage")
        check(len(view.lines("pbm-view: ")) == 1, view.text())
        check(view.quit() == 0, "Escape does not end with 0")
    with View(display, "large.pbvg", size=(64, 48)) as view:
        time.sleep(0.5)
        check(not view.lines("pbm-view: "), view.text())
        check(view.quit() == 0, "Escape does not end with 0")
    # Once only, where a picture meets it too.
    with View(display, "hidden.pbvg", "--max-error=0.3") as view:
        view.wait(lambda: view.lines("pbm-view: hidden.pbvg: 5.6.4"), "word about the damage")
        time.sleep(0.5)
        check(len(view.lines("pbm-view: ")) == 1, view.text())
        check(view.quit() == 0, "Escape does not end with 0")


def test_video_of_a_damaged_model(display):
    """--turntable of a damaged or overwritten file: exit code 3, no video, and the old video stays."""
    data = bytearray((work / "model.pbvg").read_bytes())
    offset, size = chunks_of_finest_level(work / "model.pbvg")
    data[offset + size // 2] ^= 1
    (work / "broken.pbvg").write_bytes(data)
    for old in (None, b"precious"):
        video = work / "broken.avi"
        if old:
            video.write_bytes(old)
        result = run("pbm-view", "--turntable=broken.avi", "--resolution=160,120", "--frames=3", "broken.pbvg",
                     display=display)
        drawn = run("pbm-render", "--turntable=broken.avi", "--resolution=160,120", "--frames=3", "broken.pbvg")
        check(result.returncode == drawn.returncode == 3, f"{result} {drawn}")
        check(result.stderr == drawn.stderr.replace("pbm-render", "pbm-view"), f"{result.stderr}{drawn.stderr}")
        check("saved" not in result.stdout, result.stdout)
        check((video.read_bytes() if video.exists() else None) == old, "there is a video")
    # Overwritten in place while it is recorded: what is read later does not match.
    check(run("pbm-build", "-q", "--depth", 8, "--panorama", "default", "scan.ply", "-o", "round.pbvg").returncode == 0,
          "pbm-build")
    data = bytearray((work / "round.pbvg").read_bytes())
    with View(display, "--turntable=broken.avi", "--frames=100000", "round.pbvg", loading=True) as view:
        view.wait(lambda: len(view.lines("view: ")) > 2, "frames")
        with open(work / "round.pbvg", "r+b") as file:
            file.seek(len(data) // 4)
            file.write(bytes(len(data) - len(data) // 4))
        code = view.process.wait(window_test.PATIENCE)
        check(code == 3 and view.lines("pbm-view: round.pbvg: "), f"exit code {code}: {view.text()}")
    check((work / "broken.avi").read_bytes() == b"precious" and not list(work.glob("broken.avi.*")), "there is a video")


def test_replaced_file(display):
    """A model or a scan that is written anew is shown anew, from the same camera."""
    model = work / "changing.pbvg"
    shutil.copy(work / "model.pbvg", model)
    with View(display, "changing.pbvg") as view:
        view.key("Left")
        camera = view.vectors()
        for other in ("other.pbvg", "model.pbvg"):
            shutil.copy(work / other, work / "new.pbvg")
            before = len(view.lines("view: "))
            (work / "new.pbvg").rename(model)
            view.settle(before)
            check(view.vectors() == camera, "the camera has moved")
            check_same_in_the_end(view, other, "the new file")
        # A new file that cannot be shown is told, and the old one stays.
        (work / "new.pbvg").write_text("no model")
        (work / "new.pbvg").rename(model)
        view.wait(lambda: view.lines("pbm-view: changing.pbvg: 2."), "word about the new file")
        view.key("Left")
        check(view.quit() == 0, "Escape does not end with 0")
    # A build step that runs again.
    shutil.copy(work / "scan.ply", work / "changing.ply")
    with View(display, "changing.ply") as view:
        before = len(view.lines("view: "))
        shutil.copy(work / "large.ply", work / "new.ply")
        (work / "new.ply").rename(work / "changing.ply")
        view.settle(before)
        check(run("pbm-build", "-q", "large.ply", "-o", "built.pbvg").returncode == 0, "pbm-build")
        check_same_in_the_end(view, "built.pbvg", "the new scan")
        check(view.quit() == 0, "Escape does not end with 0")


def test_file_written_in_place(display):
    """While a file is written over slowly the last picture stays; then the file is shown, or what is wrong with it is told."""
    old, new = (work / "model.pbvg").read_bytes(), (work / "other.pbvg").read_bytes()
    mapped = run("pbm-build", "-q", "--depth", 7, "--store", "mapped", "scan.ply", "-o", "mapped.pbvg")
    check(mapped.returncode == 0, f"{mapped}")
    model = work / "slow.pbvg"
    for name, more in (("model.pbvg", {}), ("mapped.pbvg", {}),
                       # As on a network: nobody tells what another machine writes.
                       ("model.pbvg", {"LD_PRELOAD": str(hold), "PBM_TEST_BLIND": "1"})):
        shutil.copy(work / name, model)
        with View(display, "slow.pbvg", **more) as view:
            shown, before = view.grab(), len(view.lines("view: "))
            with open(model, "wb", buffering=0) as copy:
                if more:
                    view.xdotool("key", "Left")  # a picture that would be drawn of the lost bytes
                wait_for_status(view, shown)
                for part in (new[:500], new[500:len(new) // 2], new[len(new) // 2:]):
                    view.xdotool("key", "Left", "key", "F2", "key", "F2")
                    time.sleep(0.4 if more else 1.5)
                    check(len(view.lines("view: ")) == before and view.process.poll() is None, view.text())
                    wait_for_status(view, shown)
                    copy.write(part)
            view.settle(before)
            check_same_in_the_end(view, "other.pbvg", "a file that was written slowly")
            check(not view.lines("pbm-view: "), f"half a file is reported: {view.text()}")
            check(view.quit() == 0, "Escape does not end with 0")

    model.write_bytes(old)
    with View(display, "slow.pbvg") as view:
        shown, before = view.grab(), len(view.lines("view: "))
        model.write_bytes(new[:len(new) // 2])
        view.wait(lambda: view.lines("pbm-view: slow.pbvg: "), "word about half a file")
        frames = len(view.lines("frame "))
        view.xdotool("key", "Left")
        time.sleep(3)
        check(len(view.lines("frame ")) < frames + 10, "the window does not rest while its file is damaged")
        wait_for_status(view, shown)
        model.write_bytes(new)
        view.settle(before)
        check_same_in_the_end(view, "other.pbvg", "a whole file after half a one")
        # A file that is removed stays as it was; one that is never finished does not hold the window.
        model.unlink()
        view.key("Left")
        check(len(view.lines("view: ")) > before + 1, "the view of a removed file does not turn")
        check(view.quit() == 0, "Escape does not end with 0")
    model.write_bytes(old)
    with View(display, "slow.pbvg") as view, open(model, "wb", buffering=0) as copy:
        shown = rendered("model.pbvg", *view.view())
        copy.write(new[:1000])
        wait_for_status(view, shown)
        check(view.quit() == 0, "Escape does not end with 0 while the file is written")
    # Lights that were moved are lost only after a question.
    model.write_bytes(old)
    with View(display, "slow.pbvg", "--panel", size=(640, 480)) as view:
        view.act("mousemove", 200, 200, "keydown", "l", "mousedown", 1, "mousemove", 260, 240, "mouseup", 1, "keyup", "l")
        before, frames = len(view.lines("view: ")), len(view.lines("frame "))
        model.write_bytes(new)
        view.wait(lambda: len(view.lines("frame ")) > frames, "question")
        time.sleep(1)
        check(len(view.lines("view: ")) == before, "the moved light is lost without a question")
        view.xdotool("key", "Return")
        view.settle(before)


if __name__ == "__main__":
    sys.exit(window_test.main([(name, test) for name, test in globals().items() if name.startswith("test_")]))
