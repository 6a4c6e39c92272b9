#!/usr/bin/env python3
"""Parses the videos and non-PNG pictures of pbm-render chunk by chunk: video.py PROGRAMS WORK_FOLDER

Frames are decoded by ImageMagick and videos by ffprobe where these are installed.
"""

import hashlib
import pathlib
import re
import shutil
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import pictures  # noqa: E402

programs, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
SIZE, FRAMES = (75, 50), 6  # an odd width: rows and frames have padding
failed = []


def check(condition, message):
    if not condition:
        failed.append(message)
        print(f"FAILED: {message}")


def run(program, *arguments, **more):
    command = [str(programs / program), *map(str, arguments)]
    return subprocess.run(command, cwd=work, capture_output=True, timeout=300, **more)


def render(*arguments, **more):
    return run("pbm-render", "model.pbvg", f"--resolution={SIZE[0]},{SIZE[1]}", *arguments, **more)


def good(result, what):
    check(result.returncode == 0, f"{what}: {result.returncode} {result.stderr.decode()}")
    return result


def read_bmp(path):
    """24 or 32 bits -> (width, height, channels, bytes of all rows, top row first)."""
    data = path.read_bytes()
    magic, size, _, offset, header, width, height, planes, bits, kind = struct.unpack("<2sIIIIiiHHI", data[:34])
    check((magic, size, planes) == (b"BM", len(data), 1), f"{path.name} is no BMP")
    check((header, bits, kind) in ((40, 24, 0), (108, 32, 3)), f"{path.name}: {header} {bits} {kind}")
    channels, rows = bits // 8, bytearray()
    stride = (width * channels + 3) // 4 * 4
    check(len(data) == offset + stride * height, f"{path.name} has {len(data)} bytes")
    for y in reversed(range(height)):
        row = data[offset + y * stride :][: width * channels]
        for x in range(0, len(row), channels):
            rows += row[x : x + 3][::-1] + row[x + 3 : x + channels]
    return width, height, channels, bytes(rows)


def chunks(data):
    """RIFF chunks: (name, offset of the data, data)."""
    at, found = 0, []
    while at < len(data):
        name, size = struct.unpack("<4sI", data[at : at + 8])
        check(at + 8 + size <= len(data), f"{name} is cut off")
        found.append((name, at + 8, data[at + 8 : at + 8 + size]))
        at += 8 + size + size % 2
    return found


def jpeg_size(data):
    """Walks the segments of a baseline JPEG to its end -> (width, height)."""
    check(data[:2] == b"\xff\xd8" and data[-2:] == b"\xff\xd9", "a frame is no JPEG")
    at, size, tables = 2, None, 0
    while data[at + 1] != 0xDA:
        marker, length = struct.unpack(">xBH", data[at : at + 4])
        if marker == 0xC0:
            bits, height, width = struct.unpack(">BHH", data[at + 4 : at + 9])
            size = (width, height)
            check(bits == 8 and data[at + 9] == 3, "not 8 bits of 3 components")
        tables += marker == 0xC4
        at += 2 + length
    check(tables > 0, "a frame has no Huffman tables")
    return size


def avi_frames(path, fps):
    """Checks every header -> JPEGs."""
    data = path.read_bytes()
    ((riff, _, body),) = chunks(data)
    check(riff == b"RIFF" and body[:4] == b"AVI " and len(body) + 8 == len(data), "no AVI")
    parts = chunks(body[4:])
    check([name for name, _, _ in parts] == [b"LIST", b"LIST", b"idx1"], f"parts {[p[0] for p in parts]}")
    header, movie, index = (part[2] for part in parts)
    check(header[:4] == b"hdrl" and movie[:4] == b"movi", "lists have other names")
    (main_name, _, main), (list_name, _, stream) = chunks(header[4:])
    check((main_name, list_name, stream[:4]) == (b"avih", b"LIST", b"strl"), "another header")
    micros, rate, _, flags, count, _, streams, largest, width, height = struct.unpack("<10I", main[:40])
    check(micros == int(1e6 / fps) and flags == 0x10 and streams == 1, f"{micros} us, flags {flags}")
    check((width, height) == SIZE, f"{width}x{height}")
    (_, _, strh), (_, _, strf) = chunks(stream[4:])
    check(strh[:8] == b"vidsMJPG", "another codec")
    scale, per_scale, start, length = struct.unpack("<4I", strh[20:36])
    check(per_scale / scale == fps and start == 0 and length == count, f"{per_scale}/{scale}, {length} of {count}")
    check(struct.unpack("<IiiHH4s", strf[:20]) == (40, *SIZE, 1, 24, b"MJPG"), "another format")
    frames = chunks(movie[4:])
    check(len(frames) == count and all(name == b"00dc" for name, _, _ in frames), f"{len(frames)} of {count} frames")
    check(largest == max(len(frame) for _, _, frame in frames), "another largest frame")
    check(rate == int(largest * fps), "another rate of bytes")
    check(len(index) == 16 * count, f"index of {len(index)} bytes")
    for i, (_, at, frame) in enumerate(frames):
        # Offsets of frames count from the name of the list.
        check(struct.unpack("<4sIII", index[16 * i : 16 * i + 16]) == (b"00dc", 0x10, 4 + at - 8, len(frame)),
              f"entry {i} of the index")
        check(jpeg_size(frame) == SIZE, f"frame {i} has another size")
    return [frame for _, _, frame in frames]


def rms(a, b):
    return (sum((x - y) ** 2 for x, y in zip(a, b)) / len(a)) ** 0.5


def decoded(frame):
    """RGB of a JPEG; None without ImageMagick."""
    if not shutil.which("convert"):
        return None
    result = subprocess.run(["convert", "jpeg:-", "-depth", "8", "rgb:-"], input=frame, capture_output=True)
    check(result.returncode == 0 and not result.stderr, f"convert: {result.stderr}")
    return result.stdout


def test_bmp():
    for options in ((), ("--no-background",)):
        good(render("-q", "-o", "a.png", *options), "PNG")
        good(render("-q", "-o", "a.bmp", *options), "BMP")
        check(read_bmp(work / "a.bmp") == pictures.read_png(work / "a.png"), f"BMP and PNG differ {options}")
        if shutil.which("convert"):
            read = subprocess.run(["convert", work / "a.bmp", "-depth", "8", "rgba:-"], capture_output=True).stdout
            wanted = subprocess.run(["convert", work / "a.png", "-depth", "8", "rgba:-"], capture_output=True).stdout
            check(read == wanted and len(read) == 4 * SIZE[0] * SIZE[1], "ImageMagick reads another BMP")


def test_pictures():
    told = good(render("--turntable", "f_%03d.png", "--frames", FRAMES, "-v"), "pictures").stdout.decode()
    views = re.findall(r"^frame (\d+): (.*)$", told, re.MULTILINE)
    check([int(number) for number, _ in views] == list(range(1, FRAMES + 1)), told)
    check(len(list(work.glob("f_*"))) == FRAMES, "another number of pictures")
    seen = set()
    for number, view in views:
        good(run("pbm-render", "-q", "model.pbvg", "-o", "single.png", *view.split()), "a view of the video")
        picture = (work / f"f_{int(number):03}.png").read_bytes()
        check(picture == (work / "single.png").read_bytes(), f"frame {number} is another picture")
        seen.add(hashlib.sha256(picture).digest())
    check(len(seen) == FRAMES, "frames repeat")
    camera = ("--camera-position=0.1,0.2,0.7", "--quality=fast")
    good(render("-q", "-o", "first.png", "--turntable", "g_%d.png", "--frames", 2, *camera), "picture and frames")
    check((work / "first.png").read_bytes() == (work / "g_1.png").read_bytes(), "the first frame is not the camera's")
    good(render("-q", "--turntable", "t_%d.bmp", "--frames", 1, "--no-background"), "transparent frames")
    check(read_bmp(work / "t_1.bmp")[2] == 4, "frames lose their transparency")


def test_avi():
    files = []
    for threads in (1, 2, 5):
        good(render("-q", "--turntable", "a.avi", "--frames", FRAMES, "--fps=12.5", f"-j{threads}"), "AVI")
        files.append((work / "a.avi").read_bytes())
    check(len(set(files)) == 1, "threads change the video")
    frames = avi_frames(work / "a.avi", 12.5)
    check(len(frames) == FRAMES, f"{len(frames)} frames")
    for number, frame in enumerate(frames, 1):
        rgb = decoded(frame)
        _, _, _, wanted = pictures.read_png(work / f"f_{number:03}.png")
        check(rgb is None or (len(rgb) == len(wanted) and rms(rgb, wanted) < 8), f"frame {number} shows something else")
    good(render("-q", "--turntable", "b.avi", "--frames", FRAMES, "--video-quality=30"), "quality")
    check((work / "b.avi").stat().st_size < len(files[0]), "quality changes nothing")
    # The switch of the dissertation names the video after the model.
    good(render("-q", "-AVI", "--frames", 2), "-AVI")
    check(len(avi_frames(work / "model.avi", 30)) == 2, "-AVI makes another video")
    if shutil.which("ffprobe"):
        told = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_entries",
                               "stream=codec_name,width,height,r_frame_rate,nb_read_frames", "-of", "csv=p=0",
                               work / "a.avi"], capture_output=True, text=True)
        check(told.stdout.strip() == f"mjpeg,{SIZE[0]},{SIZE[1]},25/2,{FRAMES}" and not told.stderr,
              f"ffprobe: {told.stdout}{told.stderr}")


def test_raw():
    result = good(render("--turntable", "-", "--frames", FRAMES), "raw frames")
    frame = 3 * SIZE[0] * SIZE[1]
    check(len(result.stdout) == FRAMES * frame, f"{len(result.stdout)} bytes")
    check(result.stderr.decode().startswith("standard output: 6 frames of 75x50, "), result.stderr.decode())
    for number in range(FRAMES):
        _, _, _, wanted = pictures.read_png(work / f"f_{number + 1:03}.png")
        check(result.stdout[number * frame : (number + 1) * frame] == wanted, f"raw frame {number} differs")
    command = f"'{programs}/pbm-render' -q model.pbvg --resolution 640,480 --turntable - | head -c 1000 >/dev/null; echo ${{PIPESTATUS[0]}}"
    told = subprocess.run(["bash", "-c", command], cwd=work, capture_output=True, text=True)
    check(told.stdout == "2\n" and "Broken pipe" in told.stderr and told.stderr.count("\n") == 1, f"{told}")


def test_mp4():
    (work / "keep.mp4").write_text("precious")
    nowhere = render("-q", "--turntable", "keep.mp4", "--frames", 2, env={"PATH": "/nonexistent"})
    check(nowhere.returncode == 4, f"without ffmpeg: {nowhere.returncode}")
    check(nowhere.stderr == b"pbm-render: keep.mp4: ffmpeg is not installed; .avi needs no other program\n", f"{nowhere.stderr}")
    # ffmpeg fails: at once, after its input, or by ending early.
    (work / "bin").mkdir()
    for script, message in (("echo 'no codec' >&2; exit 3", "failed with exit code 3: no codec"),
                            ("cat >/dev/null; exit 1", "failed with exit code 1"),
                            ("cat >/dev/null", "ended without an error and wrote nothing"),
                            ("exit 0", "ended before it had all of its input")):
        (work / "bin" / "ffmpeg").write_text(f"#!/bin/sh\n{script}\n")
        (work / "bin" / "ffmpeg").chmod(0o755)
        result = run("pbm-render", "-q", "model.pbvg", "--resolution=640,480", "--turntable", "keep.mp4", "--frames", 4,
                     env={"PATH": f"{work}/bin:/usr/bin:/bin"})
        check(result.returncode == 4, f"{script}: {result.returncode}")
        said = rf"pbm-render: keep\.mp4: (frame [1-4]: )?ffmpeg {message}; \.avi needs no other program\n"
        check(re.fullmatch(said, result.stderr.decode()), f"{script}: {result.stderr}")
    check((work / "keep.mp4").read_text() == "precious" and not list(work.glob("keep.mp4.*")), "half a video is left")
    if not shutil.which("ffmpeg"):
        return
    files = []
    for threads in (1, 3):
        good(render("-q", "--turntable", "a.mp4", "--frames", FRAMES, f"-j{threads}"), "MP4")
        files.append((work / "a.mp4").read_bytes())
    check(files[0] == files[1], "threads change the MP4")
    told = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_entries",
                           "stream=codec_name,width,height,nb_read_frames", "-of", "csv=p=0", work / "a.mp4"],
                          capture_output=True, text=True)
    check(told.stdout.strip() == f"h264,{SIZE[0] + 1},{SIZE[1]},{FRAMES}", f"ffprobe: {told.stdout}{told.stderr}")


def test_percent_signs():
    """They mean a number in the last component of numbered pictures alone, where %% is one of them."""
    folder = work / "100%d"
    folder.mkdir()
    for name, files in (("100%d/tt_%04d.png", ["100%d/tt_0001.png", "100%d/tt_0002.png"]),
                        ("a%%b_%02d.bmp", ["a%b_01.bmp", "a%b_02.bmp"]), ("100%d/%%%d%%.png", ["100%d/%1%.png", "100%d/%2%.png"]),
                        ("100%d/50%d.avi", ["100%d/50%d.avi"]), ("100%d/%s%%.mp4", ["100%d/%s%%.mp4"])):
        if name.endswith("mp4") and not shutil.which("ffmpeg"):
            continue
        good(render("-q", "--turntable", name, "--frames", 2), name)
        check(all((work / file).exists() for file in files), f"{name}: {[path.name for path in folder.iterdir()]}")
    # Programs that know no numbers.
    for arguments in (("pbm-build", "-q", "--depth", 6, "scan.ply", "-o", "100%d/%%_%d.pbvg"),
                      ("pbm-render", "-q", "100%d/%%_%d.pbvg", "-o", "100%d/%%_%d.png"),
                      ("pbm-export", "-q", "100%d/%%_%d.pbvg", "-o", "100%d/%%_%d.ply"),
                      ("pbm-sample", "-q", "--vertices", 10000, "-o", "100%d/%%_%s.ply")):
        good(run(*arguments), arguments)
        check((work / arguments[-1]).exists(), f"{arguments[0]} writes another name than {arguments[-1]}")


def test_errors():
    for arguments, code, message in (
            (("--turntable", "a.gif"), 1, "a.gif: videos are .avi, .mp4, pictures like name_%04d.png, or - for raw frames"),
            (("--turntable", "a.png"), 1, "a.png: the number of the frame is missing; choose a name like name_%04d.png"),
            (("--turntable", "a%b_%d.png"), 1, "a%b_%d.png: a % stands for the number of the frame, once, as %d or %04d; %% is a %"),
            (("--turntable", "%d/a.png"), 1, "%d/a.png: the number of the frame is missing"),
            (("--turntable", "x.avi", "-AVI"), 1, "--avi and --turntable both name a video; keep one of them"),
            (("-AVI", "--no-background"), 1, "model.avi: videos have no transparency"),
            (("-AVI", "--frames=0"), 1, "--frames: "),
            (("-AVI", "--fps=0.5"), 1, "--fps: "),
            (("-AVI", "--video-quality=101"), 1, "--video-quality: "),
            (("--turntable", "-", "-o", "-"), 1, "standard output takes one output"),
            (("--turntable", "v.avi", "-o", "v.avi"), 1, "v.avi: pictures are PNG, JPEG, BMP or EXR files"),
            (("--turntable", "f_%03d.png", "-o", "f_001.png"), 1, "f_001.png: --output and --turntable have this name"),
            (("--turntable", "nowhere/a.avi"), 2, "nowhere/a.avi: cannot write into nowhere"),
            (("--turntable", "nowhere/a%d.png"), 2, "nowhere/a1.png: cannot write into nowhere")):
        result = render("-q", *arguments)
        check(result.returncode == code, f"{arguments}: exit code {result.returncode}")
        check(result.stderr.decode().startswith(f"pbm-render: {message}") and result.stderr.count(b"\n") == 1,
              f"{arguments}: {result.stderr}")
    # A full disk: the old video stays, and no other file remains.
    (work / "full").mkdir()
    (work / "full" / "a.avi").write_text("precious")
    limited = f"ulimit -f 8; exec '{programs}/pbm-render' -q model.pbvg --resolution 320,240 --turntable"
    for name, said in (("a.avi", r"frame \d: "), ("f_%d.bmp", r"frame 1: full/f_1\.bmp: ")):
        result = subprocess.run(["bash", "-c", f"{limited} full/{name}"], cwd=work, capture_output=True, text=True)
        check(result.returncode == 2, f"a full disk, {name}: exit code {result.returncode}")
        said = f"pbm-render: full/{re.escape(name)}: {said}cannot write: File too large\n"
        check(re.fullmatch(said, result.stderr), result.stderr)
    check([path.name for path in (work / "full").iterdir()] == ["a.avi"], "a full disk leaves files")
    check((work / "full" / "a.avi").read_text() == "precious", "a full disk costs the old video")


for arguments in (("pbm-sample", "-q", "--vertices", 10000, "-o", "scan.ply"),
                  ("pbm-build", "-q", "--depth", 6, "scan.ply", "-o", "model.pbvg")):
    good(run(*arguments), arguments[0])
for name, test in [(name, test) for name, test in globals().items() if name.startswith("test_")]:
    print(name.removeprefix("test_"), flush=True)
    test()
print(f"{len(failed)} failed")
sys.exit(1 if failed else 0)
