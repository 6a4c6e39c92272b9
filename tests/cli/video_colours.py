#!/usr/bin/env python3
"""Decodes videos with ffmpeg, as players do, and compares their colours with those of the pictures:
video_colours.py PROGRAMS WORK_FOLDER SOURCE_FOLDER"""

import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import pictures  # noqa: E402
from commands import check, must  # noqa: E402

programs, work, source = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
if not shutil.which("ffmpeg") or not shutil.which("ffprobe"):
    print("skipped: ffmpeg is not installed")
    sys.exit(77)
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)

COLOURS = [(31, 165, 31), (200, 30, 30), (30, 40, 220), (240, 230, 20), (20, 230, 240), (230, 20, 230), (250, 250, 250),
           (128, 128, 128), (5, 5, 5), (255, 128, 0), (120, 60, 20), (0, 90, 160)]
BLOCK, MARGIN = 8, 4  # pixels; next to an edge, frames have the colour at half the resolution
TAGS = "color_range,color_space,color_transfer,color_primaries"
EXACT = ("-sws_flags", "accurate_rnd+full_chroma_int+full_chroma_inp+bitexact")


def write_wall():
    """Squares of these colours, four in a row."""
    points, faces = [], []
    for i, colour in enumerate(COLOURS):
        x, y = i % 4, i // 4
        faces.append([len(points) + j for j in range(4)])
        points += [(x + dx, y + dy, 0, *colour) for dx, dy in ((0, 0), (1, 0), (1, 1), (0, 1))]
    (work / "scan.ply").write_text("\n".join([
        "ply", "format ascii 1.0", f"element vertex {len(points)}", *(f"property float {axis}" for axis in "xyz"),
        *(f"property uchar {colour}" for colour in ("red", "green", "blue")), f"element face {len(faces)}",
        "property list uchar int vertex_indices", "end_header", *(" ".join(map(str, point)) for point in points),
        *("4 " + " ".join(map(str, face)) for face in faces)]) + "\n")


def render(*arguments, **options):
    return must(programs / "pbm-render", "scan.pbvg", *arguments, cwd=work, **options)


def decoded(file, *options):
    """The frames of a file as one run of R G B."""
    result = subprocess.run(["ffmpeg", "-v", "error", "-i", file, *options, "-f", "rawvideo", "-pix_fmt", "rgb24", *EXACT, "-"],
                            cwd=work, capture_output=True)
    check(result.returncode == 0 and not result.stderr, f"ffmpeg cannot decode {file}: {result.stderr}")
    return result.stdout


def tags(file):
    return must("ffprobe", "-v", "error", "-show_entries", f"stream={TAGS}", "-of", "default=nw=1:nk=1", file, cwd=work).split()


def wanted_frame(path, size):
    """The rows of a picture, its last column and row repeated."""
    width, height, channels, data = pictures.read_png(path)
    check(channels == 3, f"{path} has {channels} channels")
    rows = [data[y * width * 3 : (y + 1) * width * 3] for y in range(height)]
    rows = [row + row[-3:] * (size[0] - width) for row in rows]
    return b"".join(rows + rows[-1:] * (size[1] - height))


def flat_blocks(frame, size):
    """Corners of blocks of one colour; those at the right and lower edge end there."""
    steps = [[*range(0, length - BLOCK + 1, BLOCK), length - BLOCK] for length in size]
    for y in steps[1]:
        for x in steps[0]:
            left, top = max(x - MARGIN, 0), max(y - MARGIN, 0)
            pixels = block(frame, size, left, top, min(x + BLOCK + MARGIN, size[0]) - left,
                           min(y + BLOCK + MARGIN, size[1]) - top)
            if all(max(pixels[c::3]) - min(pixels[c::3]) <= 2 for c in range(3)):
                yield x, y


def block(frame, size, x, y, width=BLOCK, height=BLOCK):
    starts = (((y + row) * size[0] + x) * 3 for row in range(height))
    return b"".join(frame[start : start + width * 3] for start in starts)


def mean(pixels):
    return [sum(pixels[c::3]) / (len(pixels) // 3) for c in range(3)]


def compare(what, found, wanted, size):
    """Each channel of each colour within 3 of 255, in the mean of its blocks."""
    check(len(found) == len(wanted), f"{what}: {len(found)} bytes and not {len(wanted)}")
    colours = {}
    for x, y in flat_blocks(wanted, size):
        there = block(wanted, size, x, y)
        pair = colours.setdefault(tuple(round(value / 16) for value in mean(there)), [b"", b""])
        pair[0] += block(found, size, x, y)
        pair[1] += there
    for here, there in ([mean(pixels) for pixels in pair] for pair in colours.values()):
        check(max(abs(a - b) for a, b in zip(here, there)) <= 3, f"{what}: {here} and not {there}")
    check(len(colours) >= 8, f"{what}: only {len(colours)} colours are compared")


def compare_video(file, size, frames, *ways):
    """Frames are numbered pictures of the same view; `ways` of players to decode."""
    length = 3 * size[0] * size[1]
    for way in ways:
        found = decoded(file, *way)
        check(len(found) == frames * length, f"{file}: {len(found) / length} frames")
        for i in range(frames):
            wanted = wanted_frame(work / f"frame_{i + 1}.png", size)
            compare(f"{file}, frame {i + 1}, {way}", found[i * length : (i + 1) * length], wanted, size)


BT709 = ("-vf", "scale=in_color_matrix=bt709:in_range=limited")  # what players do without looking at the tags
JFIF = ("-vf", "scale=in_color_matrix=bt601:in_range=full")
write_wall()
must(programs / "pbm-build", "-q", "scan.ply", "--depth", "8", "-o", "scan.pbvg", cwd=work)

for size in ((320, 240), (321, 241)):
    view = [f"--resolution={size[0]},{size[1]}", "--frames=2", "--background-colour=0.1,0.6,0.1", "--backs=show"]
    render("-q", *view, "--turntable", "frame_%d.png")
    said = render(*view, "--turntable", "scan.mp4")
    even = tuple(length + length % 2 for length in size)
    check(("(the edge repeated to 322x242" in said) == (size != even), said)
    check(tags("scan.mp4") == ["tv", "bt709", "bt709", "bt709"], f"tags of MP4: {tags('scan.mp4')}")
    check(b"colrnclx\0\1\0\1\0\1\0" in (work / "scan.mp4").read_bytes(), "the container of the MP4 does not name its colours")
    compare_video("scan.mp4", even, 2, (), BT709)
    render("-q", *view, "--turntable", "scan.avi")
    check(tags("scan.avi")[:2] == ["pc", "bt470bg"], f"tags of AVI: {tags('scan.avi')}")
    check(b"JFIF\0\1\1" in (work / "scan.avi").read_bytes(), "the frames of the AVI are no JFIF")
    compare_video("scan.avi", size, 2, (), JFIF)

# Other forms: raw frames, frames that are BMP files, the poster of a page.
check(decoded("frame_1.png") == wanted_frame(work / "frame_1.png", size), "PNG files are not what ffmpeg decodes")
render("-q", *view, "--turntable", "frame_%d.bmp")
check(decoded("frame_2.bmp") == wanted_frame(work / "frame_2.png", size), "BMP files are other pictures")
viewer = work / "viewer"
viewer.mkdir()
shutil.copy(source / "bindings/web/page/page.html", viewer)
shutil.copy(source / "bindings/web/page/page.css", viewer)
(viewer / "pbm-viewer.js").write_text("viewer")
(viewer / "page_files.txt").write_text("pbm-viewer.js 40\n")
render("-q", *view, "--quality=fast", "-o", "still.png", "--page", "page", env={**os.environ, "PBM_WEB": str(viewer)})
compare("the poster", decoded("page/pbm-viewer/poster.jpg"), wanted_frame(work / "still.png", size), size)

# The command for ffmpeg that the manual page shows, as it stands but for the number of frames, and that of the page.
manual = must(programs / "pbm-render", "--help", "man").replace("\\-", "-").replace("\\", "")
shown = re.search(r"pbm-render scan\.pbvg --turntable - \|.*", manual)
page = (source / "docs/how-to/turntable-video.md").read_text().replace("\\\n", " ")
check(shown and " ".join(shown[0].split()) in " ".join(page.split()), f"the page shows another command than {shown}")
command = shown[0].replace("--turntable -", f"--frames 2 {shlex.join(view[2:])} --turntable -")
render("-q", "--frames=2", *view[2:], "--turntable", "frame_%d.png")
must("bash", "-euo", "pipefail", "-c", command.replace("ffmpeg ", "ffmpeg -y -v error "), cwd=work,
     env={**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"})
check(tags("scan.webm") == ["tv", "bt709", "bt709", "bt709"], f"tags of WebM: {tags('scan.webm')}")
compare_video("scan.webm", (1280, 720), 2, (), BT709)
print("passed")
