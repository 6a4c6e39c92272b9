#!/usr/bin/env python3
"""Tests the window of pbm-view on a virtual display: window_test.py PROGRAMS WORK_FOLDER SOURCE_FOLDER HOLD [TEST...]

HOLD is the library of hold_zstd.cpp. The tests grab the window from the screen and compare it, pixel by pixel, with the
picture of pbm-render for the view that `pbm-view -v` prints. Exit code 77: Xvfb, xdotool or ImageMagick is not installed.
"""

import array
import json
import math
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "cli"))
import pictures  # noqa: E402
import x11  # noqa: E402

programs, work, source, hold = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
for tool in ("Xvfb", "xdotool", "import"):
    if not shutil.which(tool):
        print(f"skipped: {tool} is not installed")
        sys.exit(77)
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)

SCREEN = (900, 700)
SIZE = (480, 360)
PATIENCE = 60  # seconds until an awaited event counts as failed
NOTICE = 5  # seconds until a notice has disappeared for sure
STATUS = 60  # pixels; what is told at the top is above


def check(condition, message):
    if not condition:
        raise AssertionError(message)


class Display:
    def __init__(self, *options):
        reader, writer = os.pipe()
        screen = f"{SCREEN[0]}x{SCREEN[1]}x24"
        command = ["Xvfb", "-displayfd", str(writer), "-screen", "0", screen, "-nolisten", "tcp", *options]
        self.process = subprocess.Popen(command, pass_fds=[writer], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(writer)
        number = os.fdopen(reader).readline().strip()
        check(number, "Xvfb does not start")
        self.name = f":{number}"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()


def environment(display):
    # Ignores memory leaks of the OpenGL driver.
    result = {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1", "LC_ALL": "C",
              "ASAN_OPTIONS": "detect_leaks=0:verify_asan_link_order=0",
              "PBM_CACHE": str(work / "cache"), "XDG_STATE_HOME": str(work / "state")}
    result.pop("DISPLAY", None)
    result.pop("WAYLAND_DISPLAY", None)
    return {**result, "DISPLAY": display} if display else result


def run(program, *arguments, display=None, **more):
    command = [str(programs / program), *map(str, arguments)]
    return subprocess.run(command, cwd=work, capture_output=True, text=True, timeout=300,
                          env={**environment(display), **more})


class View:
    """A running pbm-view, observed by its standard output. It draws fast pictures unless `arguments` ask for others."""

    def __init__(self, display, *arguments, size=SIZE, loading=False, program=programs / "pbm-view", **more):
        self.display = display
        self.log = work / f"log-{time.monotonic_ns()}.txt"
        options = ["-v", f"--resolution={size[0]},{size[1]}", *fast_unless_asked(arguments)]
        with open(self.log, "w") as log:
            self.process = subprocess.Popen([str(program), *options, *map(str, arguments)], cwd=work,
                                            stdout=log, stderr=subprocess.STDOUT, env={**environment(display), **more})
        if loading:
            self.wait(lambda: self.lines("frame "), "first frame")
        else:
            self.settle(0)
        self.window = int(self.xdotool("search", "--class", "pbm-view").split()[-1])
        self.xdotool("windowfocus", "--sync", self.window)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def xdotool(self, *arguments):
        return subprocess.run(["xdotool", *map(str, arguments)], env=environment(self.display), check=True,
                              capture_output=True, text=True).stdout

    def text(self):
        return self.log.read_text()

    def lines(self, kind):
        return [line for line in self.text().splitlines() if line.startswith(kind)]

    def wait(self, condition, what):
        end = time.monotonic() + PATIENCE
        while not condition():
            check(self.process.poll() is None, f"the program ended while {what} was waited for:\n{self.text()}")
            check(time.monotonic() < end, f"no {what}; so far:\n{self.text()}")
            time.sleep(0.02)

    def settle(self, views):
        """Waits until there were more than `views` views and the last one is shown exactly."""

        def is_settled():
            text = self.text()
            if text.count("\nview: ") + text.startswith("view: ") <= views:
                return False
            frames = re.findall(r"^frame \d+: .*, (exact|fine, \d+ of \d+ samples|\d+ chunks missing)$", text[text.rindex("view: "):], re.MULTILINE)
            return bool(frames) and (frames[-1] == "exact" or frames[-1].startswith("fine"))

        self.wait(is_settled, "finished picture of a new view")

    def act(self, *arguments):
        """Does something that changes the view, with xdotool."""
        before = len(self.lines("view: "))
        self.xdotool(*arguments)
        self.settle(before)

    def next_frame(self, *arguments):
        """Does something that changes the window but not the view."""
        before = len(self.lines("frame "))
        self.xdotool(*arguments)
        self.wait(lambda: len(self.lines("frame ")) > before, "new frame")

    def view(self):
        return self.lines("view: ")[-1].removeprefix("view: ").split()

    def pictures(self):
        """The printed figures of each frame with a picture: (error in pixels, ms, points decoded, chunks missing or None)."""
        found = re.findall(r"^frame \d+: error (\S+) pixels, levels? [\d to]+ of \d+, \d+ of \d+ points drawn, (\S+) ms, "
                           r"\d+x\d+, \d+ bytes read, (\d+) points decoded, (?:exact|gliding|fine, \d+ of \d+ samples|coarse, (\d+) chunks missing)$",
                           self.text(), re.MULTILINE)
        check(len(found) == len([line for line in self.lines("frame ") if "no picture" not in line]), self.text())
        return [(float(error), float(ms), int(points), int(missing) if missing else None)
                for error, ms, points, missing in found]

    def vectors(self):
        """Position and focal point of the camera."""
        text = " ".join(self.view())
        return [[float(n) for n in re.search(rf"--camera-{name}=(\S+)", text)[1].split(",")]
                for name in ("position", "focal-point")]

    def grab(self):
        """(width, height, RGB bytes) of the window on the screen."""
        data = subprocess.run(["import", "-silent", "-window", str(self.window), "-depth", "8", "ppm:-"],
                              env=environment(self.display), check=True, capture_output=True).stdout
        kind, size, depth, pixels = data.split(b"\n", 3)
        check((kind, depth) == (b"P6", b"255"), f"import made {kind} {depth}")
        return (*map(int, size.split()), pixels)

    def key(self, name):
        self.act("key", name)

    def quit(self):
        self.xdotool("key", "Escape")
        return self.process.wait(PATIENCE)


def fast_unless_asked(options):
    return [] if any(str(option).startswith("--quality") for option in options) else ["--quality=fast"]


def rendered(model, *options):
    result = run("pbm-render", "-q", model, "-o", "expected.png", *options, *fast_unless_asked(options))
    check(result.returncode == 0, f"pbm-render {options}: {result.stderr}")
    width, height, channels, pixels = pictures.read_png(work / "expected.png")
    check(channels == 3, "pbm-render drew something transparent")
    return width, height, pixels


def check_same(view, model, what, *options):
    """Compares the window with the picture of pbm-render for the printed view."""
    expected, shown = rendered(model, *view.view(), *options), view.grab()
    check(shown[:2] == expected[:2], f"{what}: the window has {shown[:2]}, the picture {expected[:2]}")
    different = sum(a != b for a, b in zip(shown[2], expected[2]))
    check(len(shown[2]) == len(expected[2]) and different == 0, f"{what}: {different} bytes differ")
    check(len(set(zip(*[iter(expected[2])] * 3))) > 100, f"{what}: nothing is to be seen")
    return shown


def check_same_in_the_end(view, model, what, *options):
    """Repeats check_same until it succeeds, since the window may not have drawn the last change yet."""
    end = time.monotonic() + PATIENCE
    while True:
        view.settle(0)
        try:
            return check_same(view, model, what, *options)
        except AssertionError:
            if time.monotonic() > end:
                raise


def length(v):
    return sum(n * n for n in v) ** 0.5


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def dragged(button, start, end, *modifiers):
    down = [part for m in modifiers for part in ("keydown", m)]
    up = [part for m in modifiers for part in ("keyup", m)]
    return ["mousemove", *start, *down, "mousedown", button, "mousemove", *end, "mouseup", button, *up]


def test_first_picture(display):
    with View(display, "model.pbvg") as view:
        shown = view.grab()
        expected = rendered("model.pbvg", "--resolution", f"{SIZE[0]},{SIZE[1]}")
        check(shown == expected, "the first picture is not pbm-render's")
        check_same(view, "model.pbvg", "the printed view")
        for what in ("first picture: ", "exact picture: "):
            check(len(view.lines(what)) == 1, f"the {what} is not told once: {view.text()}")
        check(view.quit() == 0, "Escape does not end with 0")


def test_loading(display):
    """While a model loads, the window says so, responds to input and can be closed."""
    held = work / "held"
    # The driver also decompresses its shader cache with zstd.
    more = {"loading": True, "LD_PRELOAD": str(hold), "PBM_TEST_HOLD": str(held), "MESA_SHADER_CACHE_DISABLE": "true"}
    for action in ("wait", "drop", "drop a model", "Escape", "close"):
        held.touch()
        with View(display, "model.pbvg", **more) as view:
            shown = view.grab()
            bright = sum(min(p) > 180 for p in zip(*[iter(shown[2])] * 3))
            check(shown[2][:3] == b"\x33\x33\x33" and bright > 100, "the window does not say that it loads")
            for key in ("F1", "Left", "F2", "space", "f"):
                view.xdotool("key", key)
            view.next_frame("key", "F1")
            view.next_frame("windowsize", view.window, 500, 300)
            check(view.grab()[:2] == (500, 300), "the window does not take another size while it loads")
            check(not view.lines("view: ") and not view.lines("saved "), "there is a view before there is a model")
            if action == "wait":
                held.unlink()
                view.settle(0)
                view.next_frame("key", "F2")
                check_same(view, "model.pbvg", "after loading")
                check(view.quit() == 0, "Escape does not end with 0")
                continue
            if action == "drop a model":
                x11.Desktop(display).drop(view.window, (work / "other.pbvg").as_uri())
                held.unlink()
                view.settle(1)
                view.next_frame("key", "F2")
                check_same(view, "other.pbvg", "a model that was dropped while another one was loaded")
                check(view.quit() == 0, "Escape does not end with 0")
                continue
            if action == "drop":
                # The dropped file is opened after the first model, and an invalid file does not end the program.
                x11.Desktop(display).drop(view.window, (work / "notes.txt").as_uri())
                held.unlink()
                view.wait(lambda: "notes.txt: " in view.text(), "word about the dropped file")
                check(len(view.lines("view: ")) == 1, "the first model is not shown")
                check(view.quit() == 0, "Escape does not end with 0")
                continue
            if action == "Escape":
                view.xdotool("key", "Escape")
            else:
                x11.Desktop(display).close(view.window)
            check(view.process.wait(PATIENCE) == 0, f"{action} does not end with 0")
            check(held.exists() and not view.lines("view: "), "the end waited for the model")
    held.unlink()


def test_refining(display):
    """The first picture shows the coarsest levels; the window responds while finer ones are loaded."""
    held = work / "held"
    more = {"loading": True, "LD_PRELOAD": str(hold), "PBM_TEST_HOLD": str(held), "PBM_TEST_HOLD_FROM": "20000",
            "MESA_SHADER_CACHE_DISABLE": "true"}
    desktop = x11.Desktop(display)
    for action in ("wait", "save", "drop", "Escape", "shrink"):
        held.touch()
        shutil.copy(work / "large.pbvg", work / "copy.pbvg")
        with View(display, "copy.pbvg", **more) as view:
            view.wait(lambda: view.lines("first picture: "), "first picture")
            error, _, decoded, missing = view.pictures()[-1]
            check(error > 2 and missing > 0, f"the first picture is not coarse: {view.text()}")
            check(not view.lines("exact picture: "), "the picture is exact before all is there")
            before = len(view.lines("view: "))
            view.xdotool("key", "Left")
            view.wait(lambda: len(view.lines("view: ")) > before, "answer to a key while chunks are loaded")
            check(len(set(zip(*[iter(view.grab()[2])] * 3))) > 100, "nothing is to be seen while chunks are loaded")
            if action == "wait":
                held.unlink()
                view.settle(before)
                check_same(view, "copy.pbvg", "a refined picture")
                check(view.pictures()[-1][0] == 2 and view.pictures()[-1][2] > decoded, view.text())
                check(len(view.lines("exact picture: ")) == 1, "the exact picture is not told once")
            elif action == "save":
                # Saves the exact picture of the view at the time of the key, also if the view changes meanwhile.
                asked = view.view()
                view.xdotool("key", "space", "key", "Right", "key", "Up")
                view.wait(lambda: len(view.lines("view: ")) > before + 1, "answer to a key while a picture is saved")
                check(not view.lines("saved "), "a coarse picture was saved")
                held.unlink()
                view.wait(lambda: view.lines("saved "), "saved picture")
                rendered("copy.pbvg", *asked)
                saved = work / view.lines("saved ")[-1].removeprefix("saved ")
                check(saved.read_bytes() == (work / "expected.png").read_bytes(), "not the picture that was asked for")
                check_same_in_the_end(view, "copy.pbvg", "after a picture was saved")
            elif action == "drop":
                views = len(view.lines("view: "))
                desktop.drop(view.window, (work / "other.pbvg").as_uri())
                view.settle(views)
                check_same(view, "other.pbvg", "a model dropped while another one was refined")
            elif action == "shrink":
                # No chunk arrives any more, nothing is reported as damaged, and the picture stays until the file is whole.
                shown = view.grab()
                os.truncate(work / "copy.pbvg", 4096)
                held.unlink()
                wait_for_status(view, shown)
                check(not view.lines("pbm-view: "), view.text())
                views = len(view.lines("view: "))
                shutil.copy(work / "large.pbvg", work / "copy.pbvg")
                view.settle(views)
                check_same_in_the_end(view, "copy.pbvg", "a file that was written anew while it was loaded")
            check(view.quit() == 0, "Escape does not end with 0")
            check(action in ("wait", "save", "shrink") or held.exists(), "the end waited for chunks")
    held.unlink(missing_ok=True)


def test_damage(display):
    """A damaged chunk is reported once, on standard error and in the window, which continues without it."""
    damaged = bytearray((work / "model.pbvg").read_bytes())
    damaged[-100] ^= 1  # in the finest level
    (work / "damaged.pbvg").write_bytes(damaged)
    refused = run("pbm-render", "damaged.pbvg", "-o", "damaged.png")
    check(refused.returncode == 3, f"pbm-render: {refused}")
    with View(display, "damaged.pbvg") as view:
        shown = view.grab()
        check(view.lines("pbm-view: ") == [refused.stderr.strip().replace("pbm-render", "pbm-view")], view.text())
        check(shown != rendered("damaged.pbvg", *view.view(), "--level=6"), "the window does not name the damage")
        for key in ("Left", "Up", "f"):
            view.key(key)
        check(len(view.lines("pbm-view: ")) == 1, f"the damage is named again: {view.text()}")
        # After the notice has disappeared the window shows the intact levels.
        end = time.monotonic() + PATIENCE
        while view.grab() != rendered("damaged.pbvg", *view.view(), "--level=6"):
            check(time.monotonic() < end, "the level above does not stand in")
            time.sleep(0.5)
        view.xdotool("key", "space")
        view.wait(lambda: view.lines("saved "), "saved picture")
        check(view.quit() == 0, "Escape does not end with 0")


def test_frame_rate(display):
    """A moving view gets coarser to keep its frame rate, and exact again when it rests."""
    drag = [part for x in range(150, 350, 5) for part in ("mousemove", x, 150, "sleep", "0.01")]
    for fps in (240, 0):
        with View(display, "large.pbvg", f"--min-fps={fps}", "--max-error=0.5", "-j1") as view:
            before = len(view.pictures())
            view.act("mousemove", 150, 150, "mousedown", 1, *drag, "mouseup", 1)
            check_same_in_the_end(view, "large.pbvg", "after a long drag", "--max-error=0.5")
            moving = view.pictures()[before:-1]
            # Exact pictures may be slow: on a slow machine the drag ends after a few of them.
            check(len(moving) > (3 if fps > 0 else 0), f"no pictures while the view moves: {view.text()}")
            coarser = [p for p in moving if p[0] > 0.5 and not p[3]]
            check(not coarser or fps > 0, f"coarser pictures without --min-fps: {coarser}")
            slow = [p for p in moving if p[1] > 1000 / 240 and p[0] == 0.5]
            check(coarser or fps == 0 or len(slow) < 3, f"the rate is not kept: {moving}")
            print(f"  --min-fps {fps}: {len(moving)} frames, largest error {max(p[0] for p in moving):.2f}")
            check(view.quit() == 0, "Escape does not end with 0")


def test_memory(display):
    """Insufficient memory is reported once, and the picture is as fine as the memory allows."""
    with View(display, "large.pbvg", "--max-memory=2800k", "--max-error=0.5", loading=True) as view:
        view.wait(lambda: "needs more memory than allowed (2 MiB)" in view.text(), "word about the memory")
        check(view.pictures()[-1][3] > 0 and not view.lines("exact picture"), view.text())
        view.next_frame("key", "Left")
        view.next_frame("key", "Right")
        view.xdotool("mousemove", 100, 100, *["click", 5] * 16)  # a distant view needs coarse levels only
        view.wait(lambda: view.lines("exact picture"), "picture that fits")
        check_same_in_the_end(view, "large.pbvg", "a picture that fits", "--max-error=0.5")
        check(view.text().count("needs more memory") == 1, "it is told again")
        check(view.quit() == 0, "Escape does not end with 0")
    # Moves along the model and back: chunks are evicted, and loaded again when they are visible again.
    decoded = {}
    for memory in ("1G", "9M"):
        with View(display, "large.pbvg", f"--max-memory={memory}", "--max-error=0.5",
                  "--camera-position=-0.05,-0.027,0.39", "--camera-focal-point=-0.05,-0.027,0",
                  "--camera-view-angle=5") as view:
            for start, end in ((400, 20),) * 4 + ((20, 400),) * 4:
                view.act(*dragged(2, (start, 150), (end, 150)))
                check_same_in_the_end(view, "large.pbvg", f"a view with {memory}", "--max-error=0.5")
            check("needs more memory" not in view.text(), "the views are too large for this test")
            decoded[memory] = view.pictures()[-1][2]
            check(view.quit() == 0, "Escape does not end with 0")
    check(decoded["9M"] > decoded["1G"], f"nothing was let go: {decoded}")


def test_target_camera(display):
    with View(display, "model.pbvg") as view:
        first = view.grab()
        position, focus = view.vectors()
        distance = length(minus(position, focus))

        def acted(what, *arguments):
            view.act(*arguments)
            check(check_same(view, "model.pbvg", what) != first, f"{what}: the picture is the same")
            now, centre = view.vectors()
            return now, centre, length(minus(now, centre))

        check(acted("Up", "key", "Up")[2] < distance * 0.99, "Up does not come nearer")
        view.key("f")
        check(view.grab() == first, "F does not show the whole model")
        check(acted("Down", "key", "Down")[2] > distance * 1.01, "Down does not go away")
        view.key("Return")
        check(view.grab() == first, "Enter does not bring the first view back")
        check(acted("wheel up", "mousemove", 100, 100, "click", 4)[2] < distance * 0.99, "the wheel does not come nearer")
        view.act("click", 5)
        check(abs(length(minus(*view.vectors())) / distance - 1) < 1e-9, "the wheel does not go back")
        view.key("Return")
        for what, arguments in (("Left", ("key", "Left")), ("A", ("key", "a")),
                                ("a drag", dragged(1, (200, 150), (260, 190)))):
            now, centre, reach = acted(what, *arguments)
            check(now != position and centre == focus, f"{what} does not turn around the focal point")
            check(abs(reach / distance - 1) < 1e-9, f"{what} changes the distance")
        view.key("Return")
        now, centre, reach = acted("a drag with the right button", *dragged(3, (200, 150), (200, 100)))
        check(centre == focus and reach < distance * 0.99, "a drag with the right button does not come nearer")
        view.key("Return")
        for what, arguments in (("a drag with the middle button", dragged(2, (200, 150), (220, 150))),
                                ("a drag with Shift", dragged(1, (220, 150), (220, 180), "shift"))):
            before = view.vectors()
            now, centre, reach = acted(what, *arguments)
            moved = length(minus(minus(now, before[0]), minus(centre, before[1])))
            check(centre != before[1] and moved < 1e-9 * distance, f"{what} does not move both ends of the view")
        check(view.quit() == 0, "Escape does not end with 0")


def test_views(display):
    """Keys glide to views of the whole model; double clicks and the wheel keep what is under the mouse."""
    with View(display, "model.pbvg") as view:
        position, focus = view.vectors()
        distance = length(minus(position, focus))
        seen = {}
        for key, name in (("1", "front"), ("2", "side"), ("3", "top"), ("4", "isometric")):
            glides = len(view.lines("view: "))
            view.key(key)
            check(len(view.lines("view: ")) > glides + 1, f"{name}: the view jumps")
            now, centre = view.vectors()
            sight = [n / length(minus(now, centre)) for n in minus(now, centre)]
            expected = {"front": (0, 0, 1), "side": (1, 0, 0), "top": (0, 1, 0), "isometric": (3**-0.5,) * 3}[name]
            check(length(minus(sight, expected)) < 1e-9, f"{name}: {now}")
            seen[name] = check_same(view, "model.pbvg", f"the {name} view")
        # A glide ends at input: the last key alone counts.
        view.act("key", "1", "key", "2")
        check(view.grab() == seen["side"], "a key does not end a glide")
        view.key("5")
        check("--projection=orthographic" in view.view(), f"5 is not orthographic: {view.view()}")
        wait_for_notice(view, "model.pbvg", "an orthographic view")
        view.key("5")
        check("--projection=orthographic" not in view.view(), "5 does not return to perspective")
        # F shows all from where the camera stands; Enter goes back to the first view.
        view.act("mousemove", 240, 180, *["click", 4] * 5)
        view.act(*dragged(1, (200, 150), (260, 190)))
        now, centre = view.vectors()
        direction = [n / length(minus(now, centre)) for n in minus(now, centre)]
        view.key("f")
        now, centre = view.vectors()
        check(length(minus([n / length(minus(now, centre)) for n in minus(now, centre)], direction)) < 1e-9,
              "F turns the model")
        view.key("Return")
        check(view.vectors() == [position, focus], "Enter does not go back to the first view")
        # However far the model is dragged away, it does not get lost.
        for _ in range(6):
            view.act(*dragged(2, (20, 20), (460, 340)))
        check(length(minus(view.vectors()[1], focus)) < distance / 2, "the model is dragged out of reach")
        view.key("Return")
        check(view.vectors() == [position, focus], "Enter does not bring a lost model back")
        check(view.quit() == 0, "Escape does not end with 0")


def pixel_of(point, camera):
    """Where a point is seen, from a camera of 30 degrees with the y axis up."""
    def product(a, b):
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    def unit(v):
        return [n / length(v) for n in v]

    position, focus = camera
    forward = unit(minus(focus, position))
    right = unit(product(forward, (0, 1, 0)))
    up, to = product(right, forward), minus(point, position)
    scale = SIZE[1] / 2 / math.tan(math.radians(15)) / sum(a * b for a, b in zip(to, forward))
    return (round(SIZE[0] / 2 + scale * sum(a * b for a, b in zip(to, right))),
            round(SIZE[1] / 2 - scale * sum(a * b for a, b in zip(to, up))))


def test_clipping(display):
    """K cuts the model open by a plane, then by a box; their dots are dragged, and the camera stays."""

    def clip(view, kind):
        found = re.findall(rf"--clip-{kind}=(\S+)", " ".join(view.view()))
        return [float(n) for n in found[0].split(",")] if found else None

    with View(display, "model.pbvg") as view:
        view.key("4")
        camera = view.vectors()
        view.key("k")
        before = clip(view, "plane")
        check(before is not None, f"K adds no plane: {view.view()}")
        dot = pixel_of(before[:3], camera)
        view.act(*dragged(1, dot, (dot[0] - 40, dot[1])))
        after = clip(view, "plane")
        moved, normal = minus(after[:3], before[:3]), before[3:]
        check(view.vectors() == camera, "a dot was dragged, and the camera moved")
        check(after[3:] == normal and length(moved) > 1e-3 and
              abs(abs(sum(m * n for m, n in zip(moved, normal))) - length(moved)) < 1e-9,
              f"the plane does not move along its normal: {before}, {after}")
        view.act(*dragged(1, (20, 20), (30, 20)))
        check(view.vectors() != camera and clip(view, "plane") == after, "beside the dots the camera does not turn")
        view.key("k")
        check(clip(view, "plane") is None and clip(view, "box") is not None, f"K adds no box: {view.view()}")
        view.key("k")
        check(clip(view, "box") is None, f"K does not end clipping: {view.view()}")
        check(view.quit() == 0, "Escape does not end with 0")
    plane = f"--clip-plane={','.join(map(str, after))}"
    with View(display, "model.pbvg", plane) as view:
        view.settle(0)
        check(clip(view, "plane") == after, f"the option is lost: {view.view()}")
        cut = check_same_in_the_end(view, "model.pbvg", "a plane of the command line")
        check(cut[2] != rendered("model.pbvg", *[o for o in view.view() if "clip" not in o])[2], "nothing is cut off")
        check(view.quit() == 0, "Escape does not end with 0")


def test_saved_views(display):
    """Control and a digit save a view; the digit glides to it, in the next session too; each model has its own."""
    with View(display, "model.pbvg") as view:
        first = view.vectors()
        view.next_frame("key", "7")  # there is none
        check(view.vectors() == first, "a view that was not saved moves the camera")
        for key in ("Left", "Up", "5"):  # one by one: a slow machine draws a picture after each
            view.key(key)
        view.wait(lambda: "--projection=orthographic" in view.view(), "orthographic view")
        saved = view.view()
        view.next_frame("key", "ctrl+6")
        view.key("Return")
        view.act("key", "6")
        check(view.view() == saved != first, f"6 shows {view.view()}, not {saved}")
        check(view.quit() == 0, "Escape does not end with 0")
    with View(display, "other.pbvg") as view:
        before = view.view()
        view.next_frame("key", "6")
        check(view.view() == before, "the view belongs to another model")
        check(view.quit() == 0, "Escape does not end with 0")
    with View(display, "model.pbvg") as view:
        view.act("key", "6")
        check(view.view() == saved, f"the next session shows {view.view()}, not {saved}")
        wait_for_notice(view, "model.pbvg", "a saved view")
        check(view.quit() == 0, "Escape does not end with 0")


def wait_for_notice(view, model, what):
    """check_same, when the notice at the bottom has disappeared."""
    end = time.monotonic() + PATIENCE
    while view.grab() != rendered(model, *view.view()):
        check(time.monotonic() < end, f"{what} is not pbm-render's")
        time.sleep(0.5)


def wait_for_status(view, before):
    """Waits until the window tells something at its top, and nothing else over the picture of `before`."""
    at = 3 * before[0] * STATUS

    def is_told():
        shown = view.grab()[2]
        return shown[:at] != before[2][:at] and shown[at:] == before[2][at:]

    view.wait(is_told, "word about the file above the last picture")


def picked(view, place):
    """The point that a click at `place` measures."""
    before = len(view.lines("point "))
    view.xdotool("mousemove", *place, "sleep", "0.1", "click", 1)
    view.wait(lambda: len(view.lines("point ")) > before, "point")
    line = view.lines("point ")[-1]
    return [float(n) for n in line.split(": ")[1].removesuffix(" units").split(", ")]


def test_measure(display):
    """M: clicks set points on the surface, where pbm-render's depths say; the mouse's zoom keeps them in place."""
    with View(display, "model.pbvg") as view:
        plain = view.grab()
        place = (200, 170)
        view.next_frame("key", "m")
        point = picked(view, place)
        result = run("pbm-render", "-q", "--quality=fast", "model.pbvg", "--depth-output=depth.pfm", *view.view()[:5])
        check(result.returncode == 0, f"{result}")
        data = (work / "depth.pfm").read_bytes()
        depths = array.array("f", data[-4 * SIZE[0] * SIZE[1]:])
        depth = depths[(SIZE[1] - 1 - place[1]) * SIZE[0] + place[0]]  # bottom row first
        position, focus = view.vectors()
        pixel = 2 * math.tan(math.radians(15)) / SIZE[1]  # the first view looks along -Z
        expected = [position[0] + (place[0] + 0.5 - SIZE[0] / 2) * pixel * depth,
                    position[1] - (place[1] + 0.5 - SIZE[1] / 2) * pixel * depth, position[2] - depth]
        check(length(minus(point, expected)) < 1e-4, f"{point} is not {expected}")
        other = picked(view, (280, 190))
        line = view.lines("distance 1 to 2: ")[-1]
        measured, uncertainty = (float(n) for n in re.search(r": (\S+) ± (\S+) units", line).groups())
        check(abs(measured - length(minus(point, other))) < 0.1 * uncertainty < 0.1 * measured, line)
        picked(view, (240, 240))
        view.xdotool("click", 1)  # at the same place
        total = float(view.lines("along all: ")[-1].split()[2])
        between = float(view.lines("distance 2 to 3: ")[-1].split()[4])
        check(abs(total - measured - between) < 0.1 * uncertainty, "the whole is not the sum")
        # A drag is no click.
        points = len(view.lines("point "))
        view.act(*dragged(1, (200, 150), (260, 190)))
        check(len(view.lines("point ")) == points, "a drag sets a point")
        view.xdotool("mousemove", 2, 2, "click", 1)
        view.next_frame("key", "x")
        check(len(view.lines("point ")) == points, "a click beside the model sets a point")
        view.next_frame("key", "BackSpace")
        view.key("Return")
        # Six notches at a point of the surface leave it under the mouse.
        before = view.vectors()
        view.act("mousemove", *place, "sleep", "0.1", *["click", 4] * 6)
        now = view.vectors()
        check(abs(length(minus(*now)) / length(minus(*before)) / 0.9**6 - 1) < 1e-9, "not six notches")
        check(length(minus(picked(view, place), point)) < 2 * uncertainty, "the wheel moves what is under the mouse")
        view.key("f")
        # Escape ends measuring, then coordinates; a double click moves a point of the surface to the middle.
        view.next_frame("key", "Delete")
        view.next_frame("key", "Escape")
        view.next_frame("key", "Escape")
        view.key("Return")
        wait_for_notice(view, "model.pbvg", "a view without measuring")
        check(view.grab() == plain, "Escape does not end measuring and coordinates")
        view.act("mousemove", *place, "sleep", "0.5", "click", 1, "click", 1)
        check(length(minus(view.vectors()[1], point)) < 2 * uncertainty, "a double click does not set the focus")
        check_same(view, "model.pbvg", "the new focus")
        views = len(view.lines("view: "))
        view.xdotool("mousemove", 2, 2, "sleep", "0.5", "click", 1, "click", 1)
        view.next_frame("key", "F2")
        check(len(view.lines("view: ")) == views, "a double click beside the model moves it")
        check(view.quit() == 0, "Escape does not end with 0")


def test_escape(display):
    """Escape takes a drag back, then ends the tool in use, then closes the panel; whoever quits is asked about points."""
    desktop = x11.Desktop(display)
    with View(display, "model.pbvg", size=(640, 480)) as view:
        first = view.view()
        view.act("mousemove", 20, 20, "mousedown", 1, "mousemove", 60, 20)
        check(view.view() != first, "the drag does not turn the model")
        view.act("key", "Escape")
        check(view.view() == first, f"Escape does not take the drag back: {view.view()}")
        views = len(view.lines("view: "))
        view.next_frame("mousemove", 90, 20, "mouseup", 1, "key", "F2", "key", "F2")
        check(len(view.lines("view: ")) == views, "a drag that was taken back goes on")
        # A light that is dragged. The panel stands open until the tools are left.
        view.next_frame("key", "Tab")
        view.act("key", "k")
        cut = view.view()
        view.act("mousemove", 200, 200, "keydown", "l", "mousedown", 1, "mousemove", 260, 240)
        view.act("key", "Escape")
        view.xdotool("mouseup", 1, "keyup", "l")
        check(any(option.startswith("--clip-plane") for option in cut) and view.view() == cut, f"{cut}, {view.view()}")
        view.key("Escape")
        check(not any("--clip" in option for option in view.view()), f"Escape leaves the clip region: {view.view()}")
        view.next_frame("key", "Escape")  # the panel
        check(view.view() == first, f"{view.view()}, not {first}")
        view.next_frame("key", "m")
        picked(view, (300, 240))
        picked(view, (340, 240))
        time.sleep(NOTICE)
        measuring = view.grab()
        view.next_frame("key", "Escape")
        wait_for_notice(view, "model.pbvg", "after measuring")
        # Neither Escape nor the window manager ends the program before the question is answered.
        for ask in (lambda: view.xdotool("key", "Escape"), lambda: desktop.close(view.window)):
            before = len(view.lines("frame "))
            ask()
            view.wait(lambda: len(view.lines("frame ")) > before, "question")
            check(view.process.poll() is None, "the program ended without a question")
            view.next_frame("key", "Escape")
            check_same_in_the_end(view, "model.pbvg", "after a question")
        view.next_frame("key", "m")
        time.sleep(NOTICE)
        check(view.grab() == measuring, "M does not show the points again")
        desktop.drop(view.window, (work / "other.pbvg").as_uri())
        view.next_frame("key", "Escape")  # the question whether to open it
        view.next_frame("key", "Escape")
        view.next_frame("key", "Escape")
        view.xdotool("key", "Return")
        check(view.process.wait(PATIENCE) == 0, "Return does not quit with 0")
        check(len(view.lines("view: ")) and "other" not in view.text(), "the other model was opened without a question")


def test_up_axis(display):
    """U makes another axis point up, and the light with it; the printed view draws the same picture."""
    with View(display, "model.pbvg") as view:
        first = view.grab()
        for axis, up in (("z", "0,0,1"), ("x", "1,0,0")):
            view.key("u")
            check({f"--up={axis}", f"--camera-view-up={up}"} <= set(view.view()), f"no view with {axis} up: {view.view()}")
            check(check_same_in_the_end(view, "model.pbvg", f"{axis} up") != first, "U does not turn the model")
            turned = view.view()
            view.key("Left")
            view.xdotool("key", "Return")
            view.wait(lambda: view.view() == turned, "first view after Enter")
        view.key("u")
        check(not [option for option in view.view() if option.startswith("--up")], f"{view.view()}")
        end = time.monotonic() + PATIENCE
        while view.grab() != first:  # the notice disappears
            check(time.monotonic() < end, "the third U does not bring the first view back")
            time.sleep(0.2)
        check(view.quit() == 0, "Escape does not end with 0")
    with View(display, "model.pbvg", "--up=z") as view:
        check_same(view, "model.pbvg", "--up z")
        check(view.grab() == rendered("model.pbvg", "--resolution", f"{SIZE[0]},{SIZE[1]}", "--up", "z"), "--up differs")
        check(view.quit() == 0, "Escape does not end with 0")


def test_flying_camera(display):
    with View(display, "-FLYING_CAMERA", "model.pbvg") as view:
        (position, focus), first = view.vectors(), view.grab()
        sight = minus(focus, position)
        view.key("Up")
        now, centre = view.vectors()
        step = minus(now, position)
        along = sum(a * b for a, b in zip(step, sight)) / length(step) / length(sight)
        check(along > 1 - 1e-9, f"Up does not fly along the view direction but {step}")
        check(length(minus(minus(centre, now), sight)) < 1e-9 * length(sight), "Up turns the camera")
        check(check_same(view, "model.pbvg", "flying ahead") != first, "flying shows nothing new")
        before = view.vectors()
        view.act(*dragged(1, (200, 150), (230, 170)))
        now, centre = view.vectors()
        check(now == before[0] and centre != before[1], "a drag does not turn the camera where it stands")
        check_same(view, "model.pbvg", "turned")
        view.key("s")
        view.key("Right")
        check_same(view, "model.pbvg", "flown to the right")
        view.next_frame("key", "c")
        before = view.vectors()
        view.key("Left")
        check(view.vectors()[1] == before[1], "C does not switch to the target camera")
        check(view.quit() == 0, "Escape does not end with 0")


def test_a_held_key_moves_on(display):
    with View(display, "model.pbvg") as view:
        before = len(view.lines("view: "))
        view.xdotool("keydown", "Left")
        view.wait(lambda: len(view.lines("view: ")) > before + 5, "steady motion")
        view.xdotool("keyup", "Left")
        check_same_in_the_end(view, "model.pbvg", "after a long press")
        check(view.quit() == 0, "Escape does not end with 0")


def test_overlays(display):
    with View(display, "model.pbvg") as view:
        first = view.grab()
        for key, name in (("F1", "help"), ("h", "help"), ("F2", "the frame time")):
            view.next_frame("key", key)
            with_text = view.grab()
            pixels = list(zip(*[iter(with_text[2])] * 3))
            check(with_text != first, f"{key} does not show {name}")
            check(sum(min(p) > 180 for p in pixels) > 100, f"{name} has no bright text")
            view.next_frame("key", key)
            check(view.grab() == first, f"{key} does not hide {name}")
        # In a small window the help is scaled down and not cut off.
        view.act("windowsize", view.window, 470, 350)
        view.next_frame("key", "F1")
        width, height, shown = view.grab()
        rows = [shown[3 * width * y : 3 * width * (y + 1)] for y in range(height)]
        check(rows[-1] == b"\x33" * 3 * width and {row[-3:] for row in rows} == {b"\x33" * 3}, "the help is cut off")
        check(sum(min(p) > 180 for p in zip(*[iter(shown)] * 3)) > 100, "the help of a small window has no text")
        view.next_frame("key", "Escape")
        check(view.quit() == 0, "Escape does not end with 0")
    with View(display, "--show-frame-time", "model.pbvg") as view:
        check(view.grab() != first, "--show-frame-time shows nothing")
        view.next_frame("key", "F2")
        check(view.grab() == first, "F2 does not hide the frame time")


def test_saving(display):
    precious = work / "model-1.png"
    precious.write_text("precious")
    with View(display, "model.pbvg") as view:
        for number, key in ((2, "space"), (3, "F12")):
            view.key("Left")
            view.xdotool("key", key)
            view.wait(lambda: len(view.lines("saved ")) == number - 1, "saved picture")
            check(view.lines("saved ")[-1] == f"saved model-{number}.png", view.text())
            rendered("model.pbvg", *view.view())
            check((work / f"model-{number}.png").read_bytes() == (work / "expected.png").read_bytes(),
                  f"model-{number}.png is not pbm-render's picture")
        # Escape directly after a save must not lose the picture.
        view.xdotool("key", "space", "key", "Escape")
        check(view.process.wait(PATIENCE) == 0, "Escape does not end with 0")
        check((work / "model-4.png").read_bytes() == (work / "expected.png").read_bytes(), "the last picture is lost")
    check(precious.read_text() == "precious", "a picture was overwritten")
    precious.unlink()


def test_window_sizes(display):
    desktop = x11.Desktop(display)
    with View(display, "model.pbvg") as view:
        view.act("windowsize", view.window, 333, 251)
        check(view.view()[0] == "--resolution=333,251", f"another size: {view.view()}")
        check_same(view, "model.pbvg", "resized")
        view.key("F11")
        check(view.view()[0] == f"--resolution={SCREEN[0]},{SCREEN[1]}", f"no full screen: {view.view()}")
        check_same(view, "model.pbvg", "full screen")
        view.key("Escape")
        check(view.view()[0] == "--resolution=333,251", f"not the size before full screen: {view.view()}")
        view.xdotool("windowfocus", "--sync", view.window)
        # A minimised window draws nothing, and draws again afterwards.
        desktop.set_minimised(view.window, True)
        time.sleep(0.3)
        frames, views = len(view.lines("frame ")), len(view.lines("view: "))
        view.xdotool("key", "Left")
        time.sleep(0.5)
        check(len(view.lines("frame ")) == frames, "draws while minimised")
        desktop.set_minimised(view.window, False)
        view.settle(views)
        check_same(view, "model.pbvg", "no longer minimised")
        desktop.close(view.window)
        check(view.process.wait(PATIENCE) == 0, "the close button does not end with 0")


def test_dropping_a_file(display):
    desktop = x11.Desktop(display)
    with View(display, "model.pbvg", "--camera-position=0,0.1,0.5") as view:
        check_same(view, "model.pbvg", "a camera of the command line")
        views = len(view.lines("view: "))
        desktop.drop(view.window, (work / "other.pbvg").as_uri())
        view.settle(views)
        check_same(view, "other.pbvg", "the dropped model")
        expected = rendered("other.pbvg", "--resolution", f"{SIZE[0]},{SIZE[1]}")
        check(view.grab() == expected, "a dropped model is not shown by the default camera")
        title = view.xdotool("getwindowname", view.window)
        check(title.startswith("other.pbvg"), f"the title is {title}")
        # An invalid file is reported in the window, which continues.
        desktop.drop(view.window, (work / "notes.txt").as_uri())
        # Escape would cancel the opening while it lasts.
        view.wait(lambda: "notes.txt: " in view.text(), "word about a file that is no model")
        view.wait(lambda: view.grab() != expected, "word in the window about a file that is no model")
        view.key("Left")
        check(view.quit() == 0, "Escape does not end with 0")


def test_rest(display):
    """Nothing is drawn while nothing changes."""
    with View(display, "model.pbvg") as view:
        time.sleep(0.5)
        frames, spent = len(view.lines("frame ")), processor_time(view.process.pid)
        time.sleep(1)
        idle = processor_time(view.process.pid) - spent
        check(view.quit() == 0, "Escape does not end with 0")
        check(view.lines("frames: ") == [f"frames: {frames}"], f"frames were drawn: {view.lines('frames: ')}, {frames}")
        print(f"  processor time of an idle second: {1000 * idle:.0f} ms")


def processor_time(process):
    fields = pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def test_options(display):
    with View(display, "model.pbvg", "-IGNORE_POINT_COLOURS", "--background-color=0.1,0.2,0.9", "--level=4") as view:
        shown = view.grab()
        expected = rendered("model.pbvg", *view.view(), "--level=4")
        check(shown == expected, "colours or level are not those of pbm-render")
        check(view.quit() == 0, "Escape does not end with 0")
    with View(display, "-q", "model.pbvg", "-v") as view:
        check(view.quit() == 0, "Escape does not end with 0")


def test_panel(display):
    """Tab shows the panel. Its changes are visible at once and saved; its input does not move the camera; no idle frames."""
    size = (640, 480)
    left = size[0] - 330 - 12 + 19  # x of the checkboxes of the panel

    def clicked(y, x=left):
        return ["mousemove", x, y, "sleep", "0.1", "click", 1]

    with View(display, "model.pbvg", size=size) as view:
        first = view.grab()
        view.next_frame("key", "Tab")
        check(view.grab() != first, "Tab shows no panel")
        time.sleep(0.3)
        frames = len(view.lines("frame "))
        time.sleep(1)
        check(len(view.lines("frame ")) == frames, "frames are drawn while the panel is open and nothing changes")
        view.act(*clicked(53))
        check("--ignore-point-colours" in view.view(), f"no other look: {view.view()}")
        view.act(*clicked(161, left + 80))
        check(any(option.startswith("--exposure=") for option in view.view()), f"no other exposure: {view.view()}")
        views = len(view.lines("view: "))
        view.xdotool(*dragged(1, (left + 200, 115), (left + 250, 140)), "click", 4)
        view.xdotool("key", "space")
        view.wait(lambda: view.lines("saved "), "saved picture")
        check(len(view.lines("view: ")) == views, "the panel's input moves the camera")
        rendered("model.pbvg", *view.view())
        saved = work / view.lines("saved ")[-1].removeprefix("saved ")
        check(saved.read_bytes() == (work / "expected.png").read_bytes(), "another picture is saved")
        view.act(*dragged(1, (40, 300), (60, 330)))
        view.next_frame("key", "Tab")
        check_same_in_the_end(view, "model.pbvg", "a look of the panel")  # waits until the notice has disappeared
        view.key("Return")
        view.next_frame("key", "Tab")
        # Makes a light brighter, then resets it.
        view.next_frame(*clicked(291))
        view.act(*clicked(395, left + 140))
        view.next_frame(*clicked(291))
        view.next_frame("key", "Tab")
        brighter = view.grab()
        check(sum(brighter[2]) > sum(rendered("model.pbvg", *view.view())[2]), "the light is not brighter")
        view.next_frame("key", "Tab")
        view.act(*clicked(343))
        view.next_frame("key", "Tab")
        check_same_in_the_end(view, "model.pbvg", "the look after Reset")
        check(view.quit() == 0, "Escape does not end with 0")
    # Keys typed into a number field, including Escape and Return, are not commands of the window.
    field = (left + 60, 421)
    with View(display, "--panel", "model.pbvg", size=size) as view:
        check(view.grab() != first, "--panel does not show it")
        view.next_frame(*clicked(291))
        view.next_frame("mousemove", *field, "sleep", "0.1", "keydown", "ctrl", "click", 1, "keyup", "ctrl")
        camera = view.vectors()
        view.act("key", "c", "key", "4", "key", "5", "key", "Left", "key", "Escape")
        time.sleep(0.5)
        check(view.vectors() == camera and view.process.poll() is None, "the window takes what is typed")
        view.next_frame("mousemove", *field, "sleep", "0.1", "keydown", "ctrl", "click", 1, "keyup", "ctrl")
        view.act("key", "4", "key", "5", "key", "Return")
        # Escape goes one step back: the help, the panel, a question since a light was moved, and at last the program.
        view.next_frame("key", "F1")
        for shown in ("the help", "the panel", "the window"):
            view.next_frame("key", "Escape")
            check(view.process.poll() is None, f"Escape over {shown} ends the program")
        view.next_frame("key", "Escape")
        check(view.process.poll() is None, "Escape at the question does not go back")
        x11.Desktop(display).close(view.window)
        time.sleep(0.3)
        check(view.process.poll() is None, "the close button loses edits without a question")
        view.xdotool("key", "Return")
        check(view.process.wait(PATIENCE) == 0, "Return does not quit")
    # The keyboard moves through the panel, and Escape gives it back to the view.
    with View(display, "model.pbvg", size=size) as view:
        camera = view.vectors()
        view.next_frame("key", "F6")
        view.act("key", "Down", "key", "Up", "key", "space")  # the first checkbox: point colours
        check("--ignore-point-colours" in view.view(), f"the keyboard does not reach the panel: {view.view()}")
        check(view.vectors() == camera, "the panel's keys move the camera")
        view.next_frame("key", "Escape")
        view.act("key", "Left")
        check(view.vectors() != camera, "the view does not get the keyboard back")


def test_fields(display):
    """The points have the colours of the field that the command line or the panel names; the view stays."""
    shutil.copyfile(source / "format_spec/vectors/valid/fields.pbvg", work / "fields.pbvg")
    with View(display, "--colour-by=height", "fields.pbvg", size=(640, 480)) as view:
        check_same(view, "fields.pbvg", "the colours of a field")
        view.key("Right")
        camera = view.vectors()
        view.next_frame("key", "Tab")
        view.next_frame("mousemove", 360, 234, "sleep", "0.1", "click", 1)  # the list of fields
        view.act("mousemove", 340, 321, "sleep", "0.1", "click", 1)         # its last line
        check("--colour-by=class" in view.view(), f"another field: {view.view()}")
        check(view.vectors() == camera, "the camera moved")
        view.next_frame("key", "Tab")
        check_same_in_the_end(view, "fields.pbvg", "the colours of another field")
        for name in ("normal", "plain"):
            view.act("key", "n")
            check(f"--colour-by={name}" in view.view(), f"N goes on to {name}: {view.view()}")
            check_same_in_the_end(view, "fields.pbvg", f"the colours {name}")
        view.act("key", "n")
        check(not any(option.startswith("--colour-by") for option in view.view()), "N does not end at the file's own")
        check(view.quit() == 0, "Escape does not end with 0")


def test_panel_beside_the_picture(display):
    """In a wide window the picture is drawn beside the panel, so that the panel covers nothing of it."""
    with View(display, "model.pbvg", size=(900, 400)) as view:
        view.act("key", "Tab")
        check(view.view()[0] == "--resolution=546,400", f"the picture has {view.view()[0]}")
        expected, shown = rendered("model.pbvg", *view.view()), view.grab()
        rows = [shown[2][3 * 900 * y:3 * (900 * y + 546)] for y in range(400)]
        check(b"".join(rows) == expected[2], "the picture beside the panel is not pbm-render's")
        view.act("key", "Tab")
        check_same_in_the_end(view, "model.pbvg", "the picture without the panel")


def lit_model(name):
    """A model with a spot light from the left, which casts shadows on it and on the ground."""
    result = run("pbm-build", "-q", "--depth", 7, "scan.ply", "--light=spot,from=-2,1,1,exponent=4", "--shadows",
                 "--ground", "-o", name)
    check(result.returncode == 0, result.stderr)


def info(name):
    result = run("pbm-info", "--json", name)
    check(result.returncode == 0, result.stderr)
    return json.loads(result.stdout)


def brightness(picture):
    return sum(picture[2]) / len(picture[2])


def test_moved_lights(display):
    """L moves a light round the model; its shadows are baked anew; what is saved looks as the window did."""
    lit_model("lit.pbvg")
    before = (work / "lit.pbvg").read_bytes()
    with View(display, "lit.pbvg") as view:
        first = view.grab()
        view.act("keydown", "l", *dragged(1, (240, 180), (420, 150)), "keyup", "l")
        view.wait(lambda: view.grab() != first, "moved light")
        stale = view.grab()
        view.wait(lambda: "shadows: baked\nframe " in view.text(), "picture with new shadows")
        time.sleep(0.5)
        moved = view.grab()
        check(moved != stale, "the new shadows are not seen")
        check(brightness(moved) > 0.5 * brightness(first), "the model got dark")
        check(moved != first, "the light does not move")
        camera = view.view()
        # Ctrl+S asks first.
        view.next_frame("key", "ctrl+s")
        view.next_frame("key", "Escape")
        check((work / "lit.pbvg").read_bytes() == before, "saved without an answer")
        view.xdotool("key", "ctrl+s", "key", "Return")
        view.wait(lambda: view.lines("saved lit.pbvg"), "saved model")
        view.wait(lambda: view.grab() == moved, "end of the notice")
        expected = rendered("lit.pbvg", *camera)
        different = sum(abs(a - b) > 3 for a, b in zip(moved[2], expected[2]))
        check(different < len(moved[2]) / 1000, f"the saved model looks different: {different} bytes")
        result = run("pbm-validate", "--deep", "lit.pbvg")
        check(result.returncode == 0, f"{result}")
        check("view" in info("lit.pbvg")["metadata"], "the view is not saved")
        check(view.quit() == 0, "Escape does not end with 0 after the model was saved")
    # The window starts with the saved view.
    with View(display, "lit.pbvg") as view:
        check(view.view() == camera, f"{view.view()}, saved {camera}")
        view.act("keydown", "l", *dragged(1, (240, 180), (60, 60)), "keyup", "l")
        # Another program replaces the file: saving refuses.
        shutil.copy(work / "model.pbvg", work / "other-lit.pbvg")
        os.replace(work / "other-lit.pbvg", work / "lit.pbvg")
        view.xdotool("key", "ctrl+s", "key", "Return")  # waits for the shadows
        view.wait(lambda: "another program has changed the file" in view.text(), "refusal to save")
        check((work / "lit.pbvg").read_bytes() == (work / "model.pbvg").read_bytes(), "a foreign file was replaced")
        # R saves a recipe, with which the builder makes the same lights.
        view.xdotool("key", "ctrl+s", "key", "r")
        view.wait(lambda: view.lines("saved lit-1.toml"), "saved recipe")
        result = run("pbm-build", "-q", "--depth", 7, "--recipe", "lit-1.toml", "scan.ply", "-o", "again.pbvg")
        check(result.returncode == 0, f"{result}\n{(work / 'lit-1.toml').read_text()}")
        check(view.quit() == 0, "Escape asks although a recipe was saved")


def test_lights_that_follow_the_eye(display):
    """A model without lights is lit from beside the eye; L moves its light for every side; saved lights stay."""
    shutil.copy(work / "model.pbvg", work / "unlit.pbvg")
    with View(display, "unlit.pbvg") as view:
        view.key("Left")
        check_same_in_the_end(view, "unlit.pbvg", "light from beside the eye")
        fixed = rendered("unlit.pbvg", *view.view(), "--light-follows=model")
        check(fixed[2] != view.grab()[2], "the light stays with the model")
        view.act("keydown", "l", *dragged(1, (240, 180), (420, 60)), "keyup", "l")
        view.key("Left")
        time.sleep(0.5)
        moved, camera = view.grab(), view.view()
        view.xdotool("key", "ctrl+s", "key", "Return")
        view.wait(lambda: view.lines("saved unlit.pbvg"), "saved model")
        check_same_in_the_end(view, "unlit.pbvg", "the saved light")
        different = sum(abs(a - b) > 3 for a, b in zip(moved[2], view.grab()[2]))
        check(different < len(moved[2]) / 1000, f"the saved model looks different: {different} bytes")
        check(view.quit() == 0, "Escape does not end with 0 after the model was saved")
    eye = rendered("unlit.pbvg", *camera, "--light-follows=eye")
    check(eye[2] != moved[2], "the lights of a file do not follow the eye")
    with View(display, "--light-follows=model", "model.pbvg") as view:
        view.key("Left")
        check("--light-follows=model" in view.view(), f"{view.view()}")
        check_same_in_the_end(view, "model.pbvg", "a light that stays with the model")


def test_headlight_and_options(display):
    """Ctrl+C copies a command that draws the picture; a headlight follows the camera."""
    with View(display, "--headlight=-30,20", "model.pbvg") as view:
        check_same(view, "model.pbvg", "a headlight")
        view.key("Left")
        check("--headlight=-30,20" in view.view(), f"{view.view()}")
        check_same_in_the_end(view, "model.pbvg", "a headlight from another side")
        view.xdotool("key", "ctrl+c")
        view.wait(lambda: view.lines("pbm-render "), "copied options")
        copied = x11.Desktop(display).clipboard()
        check(copied.splitlines()[0] == view.lines("pbm-render ")[-1], f"the clipboard holds {copied}")
        words = shlex.split(copied)
        result = run(*words[:-1], "copied.png")
        check(result.returncode == 0, f"{copied}: {result.stderr}")
        rendered("model.pbvg", *view.view())
        check((work / "copied.png").read_bytes() == (work / "expected.png").read_bytes(), "the command draws another picture")
        # With L the headlight is dragged; it stays with the camera.
        view.act("keydown", "l", *dragged(1, (240, 180), (240, 20)), "keyup", "l")
        view.wait(lambda: "--headlight=0,63" in view.view(), "raked headlight")
        check_same_in_the_end(view, "model.pbvg", "a raking headlight")


def test_fine(display):
    """A resting view accumulates samples until it equals the picture of pbm-render; input stops this at once."""
    for quality in ("--quality=auto", "--quality=fine"):  # auto is the default
        unprinted = [quality] if quality == "--quality=auto" else []
        with View(display, "model.pbvg", quality, "--samples=3") as view:
            def fine_frames():
                return re.findall(r"fine, (\d+) of 3 samples$", view.text()[view.text().rindex("view: "):], re.MULTILINE)

            def is_fine():
                return fine_frames()[-1:] == ["3"]

            view.wait(is_fine, "fine picture")
            check(("--quality=fine" in view.view()) == (not unprinted), f"not the options of the picture: {view.view()}")
            check_same(view, "model.pbvg", "a fine picture", *unprinted)
            frames = len(view.lines("frame "))
            time.sleep(0.5)
            check(len(view.lines("frame ")) == frames, "frames are drawn when the picture is fine")
            view.act("key", "Left")
            view.wait(is_fine, "fine picture of another view")
            check_same(view, "model.pbvg", "a fine picture of another view", *unprinted)
            check(fine_frames() in (["1", "3"], ["1", "3", "3"]), f"samples {fine_frames()}")
            view.xdotool("key", "space")
            view.wait(lambda: view.lines("saved "), "saved picture")
            rendered("model.pbvg", *view.view(), *unprinted)
            saved = work / view.lines("saved ")[-1].removeprefix("saved ")
            check(saved.read_bytes() == (work / "expected.png").read_bytes(), "another picture is saved")
            check(view.quit() == 0, "Escape does not end with 0")
    # A view that moves is drawn fast: samples are added only after it has rested.
    with View(display, "large.pbvg", "--quality=auto", "--samples=64") as view:
        before = len(view.lines("view: "))
        view.xdotool("keydown", "Left")
        view.wait(lambda: len(view.lines("view: ")) > before + 5, "steady motion")
        moving = view.text()[view.text().rindex("view: ", 0, view.text().rindex("view: ")):]
        view.xdotool("keyup", "Left")
        check("fine" not in moving, f"a moving view is refined: {moving}")
        view.wait(lambda: "fine, " in view.text()[view.text().rindex("view: "):], "refinement of the view at rest")
        view.xdotool("key", "Left", "key", "Up", "key", "Left")
        view.settle(before)
        check(view.quit() == 0, "Escape does not end with 0")
    for quality in ("--quality=auto", "--quality=fine"):
        result = run("pbm-view", "-AVI", "-q", quality, "--samples=2", "--resolution=160,120", "--frames=3", "model.pbvg",
                     display=display)
        check(result.returncode == 0 and not result.stderr, f"{result}")
        drawn = run("pbm-render", "-q", "--turntable=fine.avi", quality, "--samples=2", "--resolution=160,120",
                    "--frames=3", "model.pbvg")
        check(drawn.returncode == 0 and (work / "model.avi").read_bytes() == (work / "fine.avi").read_bytes(), "video")


def test_recording(display):
    """-AVI: records one orbit, shows it meanwhile, writes the same video as pbm-render, and exits."""
    options = ("--resolution=160,120", "--frames=7", "model.pbvg")
    for more in ((), ("--ignore-point-colours", "--camera-position=0.1,0.2,0.4")):
        result = run("pbm-view", "-AVI", "-v", *options, *more, display=display)
        check(result.returncode == 0 and not result.stderr, f"{result}")
        check(result.stdout.count("view: ") == 8 and "saved model.avi\n" in result.stdout, result.stdout)
        made = (work / "model.avi").read_bytes()
        check(run("pbm-render", "-q", "--turntable", "expected.avi", *options, *more).returncode == 0, "pbm-render")
        check(made == (work / "expected.avi").read_bytes(), "the video is not pbm-render's")
    (work / "model.avi").write_text("precious")
    with View(display, "-AVI", "--frames=100000", "model.pbvg") as view:
        view.wait(lambda: len(view.lines("view: ")) > 3, "frames")
        view.xdotool("key", "3", "key", "f")  # views of a video do not glide
        before = len(view.lines("view: "))
        view.wait(lambda: len(view.lines("view: ")) > before + 3, "more frames")
        check("gliding" not in view.text(), "a key moves the camera of a video")
        check(view.quit() == 0, "Escape does not end with 0")
        check(view.lines("stopped: model.avi was not written"), view.text())
    check((work / "model.avi").read_text() == "precious", "half a video replaces one")
    check(not list(work.glob("model.avi.*")), "half a video is left")
    result = run("pbm-view", "--turntable=nowhere/a.avi", *options, display=display)
    check(result.returncode == 2 and result.stderr.count("\n") == 1, f"{result}")
    result = run("pbm-view", "--turntable=model.pbvg", *options, display=display)
    check(result.returncode == 1, f"{result}")


def test_sample(display):
    with View(display) as view:
        sample = programs / ".." / "share" / "pbm" / "sample.pbvg"
        view.next_frame("key", "Escape")  # closes the start page
        check_same(view, sample, "the sample")
        title = view.xdotool("getwindowname", view.window)
        check(title.startswith("sample.pbvg"), f"the title is {title}")
        # After a drag through many views the window shows the exact picture of the last one.
        path = [part for x in range(200, 300, 4) for part in ("mousemove", x, 150)]
        view.act("mousemove", 200, 150, "mousedown", 1, *path, "mouseup", 1)
        check_same_in_the_end(view, sample, "the sample after a long drag")
        check(view.quit() == 0, "Escape does not end with 0")


def test_bad_files(display):
    good = bytearray((work / "model.pbvg").read_bytes())
    (work / "short.pbvg").write_bytes(good[:1000])
    good = bytearray((work / "other.pbvg").read_bytes())
    good[-100] ^= 1
    (work / "flipped.pbvg").write_bytes(good)  # damage that loading finds; the model has coarse levels only
    invalid = source / "format_spec" / "vectors" / "invalid"
    codes = set()
    for file in ("none.pbvg", "notes.txt", "short.pbvg", "flipped.pbvg", invalid / "2.5-major-version-7.pbvg",
                 invalid / "2.6-required-feature-40.pbvg", invalid / "4.2-zero-mask.pbvg"):
        drawn = run("pbm-render", file, "-o", "bad.png")
        with View(display, file, loading=True) as view:
            view.wait(lambda: view.lines("pbm-view: "), "word on standard error")
            time.sleep(0.1)  # the window may wait for a frame
            code = view.quit()
            check(code == drawn.returncode != 0, f"{file}: {code}, pbm-render {drawn.returncode}")
            told = "".join(line + "\n" for line in view.lines("pbm-view: "))
            check(told == drawn.stderr.replace("pbm-render", "pbm-view"), f"{file}: {told}{drawn.stderr}")
        # Without a display the file's error is the one that is told.
        shown = run("pbm-view", file)
        if file in ("none.pbvg", "short.pbvg"):  # others are found while the window opens
            check(shown.returncode == code and shown.stderr == told, f"{file}: {shown}")
        # A video is not begun.
        shown = run("pbm-view", "--turntable=bad.avi", file, display=display)
        check(shown.returncode == code and shown.stderr == told, f"{file}: {shown}")
        check(not (work / "bad.avi").exists(), f"{file} has a video")
        codes.add(code)
    check(codes == {2, 3, 5}, f"exit codes {codes}")
    for arguments, code in ((("--max-memory=1k", "model.pbvg"), 4), (("--camera-mode=walk", "model.pbvg"), 1),
                            (("--turntable=-", "model.pbvg"), 1),
                            (("--camera-position=1,2,3", "--camera-focal-point=1,2,3", "model.pbvg"), 1)):
        result = run("pbm-view", *arguments, display=display)
        check(result.returncode == code and len(result.stderr.splitlines()) == 1, f"{arguments}: {result}")


def test_no_window():
    """Without display or OpenGL: one line, exit code 4."""

    def refused(result, words):
        check(result.returncode == 4, f"exit code {result.returncode}: {result.stderr}")
        check(re.fullmatch(f"pbm-view: {words}[^\n]*; pbm-render draws without display and OpenGL\n", result.stderr),
              result.stderr)

    refused(run("pbm-view", "model.pbvg"), "there is no display: ")
    refused(run("pbm-view", "model.pbvg", display=":54321"), "there is no display: ")
    with Display("-extension", "GLX") as display:
        refused(run("pbm-view", "model.pbvg", display=display.name), "the display has no OpenGL 3.2: ")
    with Display() as display:
        refused(run("pbm-view", "model.pbvg", display=display.name, MESA_GL_VERSION_OVERRIDE="2.1"),
                "the display has no OpenGL 3.2: ")
    check(run("pbm-view", "--help").returncode == 0, "--help needs a display")
    check(run("pbm-view", "-V").stdout.startswith("pbm-view "), "-V needs a display")


def test_display_goes_away():
    """The X server ends: pbm-view prints a line of its own last and exits with code 4."""
    with Display() as display, View(display.name, "model.pbvg") as view:
        display.process.terminate()
        code = view.process.wait(PATIENCE)
        check(code == 4, f"exit code {code}: {view.text()}")
        check(view.text().splitlines()[-1].startswith("pbm-view: the display has taken the window away"), view.text())


def test_first_start(display):
    """The first start of a user shows a hint, which fades; later ones do not."""
    for first in (True, False):
        with View(display, "model.pbvg", XDG_STATE_HOME=str(work / "new state")) as view:
            plain = rendered("model.pbvg", *view.view())
            check((view.grab() != plain) == first, f"the hint is {'not ' if first else ''}shown")
            view.wait(lambda: view.grab() == plain, "end of the hint")
            check(view.quit() == 0, "Escape does not end with 0")


def test_themes(display):
    """The theme is the desktop's, which its portal names, unless it is chosen."""
    portal = work / "portal"
    portal.mkdir()
    (portal / "gdbus").write_text("#!/bin/sh\necho '(<<uint32 2>>,)'\n")
    (portal / "gdbus").chmod(0o755)
    shown = {}
    for theme in ("dark", "light", "desktop"):
        with View(display, "--panel", f"--theme={theme}", "model.pbvg") as view:
            shown[theme] = brightness(view.grab())
    check(shown["light"] > shown["dark"] + 20, f"brightness {shown}")
    check(shown["desktop"] == shown["dark"], f"a desktop that says nothing: {shown}")
    with View(display, "--panel", "--theme=desktop", "model.pbvg", PATH=f"{portal}:{os.environ['PATH']}") as view:
        check(brightness(view.grab()) == shown["light"], f"a light desktop is not followed: {shown}")


def test_high_resolution(display):
    """At 192 dots per inch, twice the usual, text is twice as large."""
    desktop = x11.Desktop(display)
    written = {}
    for dpi in (96, 192):
        desktop.set_resources(f"Xft.dpi:\t{dpi}\n")
        with View(display, "model.pbvg", size=(800, 600)) as view:
            check_same(view, "model.pbvg", f"{dpi} dots per inch")
            before = view.grab()
            view.xdotool("key", "F2")
            view.wait(lambda: view.grab() != before, "costs of a picture")
            written[dpi] = sum(a != b for a, b in zip(before[2], view.grab()[2]))
    check(2.5 * written[96] < written[192] < 5 * written[96], f"bytes that the text changes: {written}")


def main(tests):
    (work / "state" / "pbm").mkdir(parents=True)
    (work / "state" / "pbm" / "started").touch()
    (work / "notes.txt").write_text("no scan")
    for arguments in (("pbm-sample", "-q", "--vertices", 20000, "-o", "scan.ply"),
                      ("pbm-build", "-q", "--depth", 7, "scan.ply", "-o", "model.pbvg"),
                      ("pbm-build", "-q", "--depth", 6, "scan.ply", "-o", "other.pbvg"),
                      ("pbm-sample", "-q", "--vertices", 300000, "-o", "large.ply"),
                      ("pbm-build", "-q", "--depth", 9, "large.ply", "-o", "large.pbvg")):
        result = run(*arguments)
        if result.returncode != 0:
            sys.exit(f"FAILED: {arguments}: {result.stderr}")
    failed = 0
    wanted = sys.argv[5:]
    for name, test in tests:
        if wanted and name.removeprefix("test_") not in wanted:
            continue
        print(name.removeprefix("test_"), flush=True)
        try:
            if test in (test_no_window, test_display_goes_away):
                test()
            else:
                with Display() as display:
                    test(display.name)
        except (AssertionError, subprocess.SubprocessError) as problem:
            failed += 1
            print(f"  FAILED: {problem}", flush=True)
    print(f"{len(tests)} tests, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main([(name, test) for name, test in globals().items() if name.startswith("test_")]))
