#!/usr/bin/env python3
"""Installs the build into an empty prefix and asks what a desktop would: is each file valid, which type has a model,
what opens it, and what is its thumbnail: check_desktop.py CMAKE BUILD WORK_FOLDER"""

import configparser
import json
import os
import pathlib
import shlex
import shutil
import struct
import subprocess
import sys
import xml.etree.ElementTree

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent.parent / folder) for folder in (".", "cli")]
from commands import check, must  # noqa: E402
from pictures import read_png  # noqa: E402

MODEL_TYPE = "model/vnd.pbm.pbvg"
THUMBNAIL_MEMORY = 64_000_000  # bytes

cmake, build, work = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
missing = [name for name in ("desktop-file-validate", "update-desktop-database", "appstreamcli", "update-mime-database",
                             "xdg-mime", "gio") if not shutil.which(name)]
if missing:
    print("skipped: not installed:", *missing)
    sys.exit(77)
shutil.rmtree(work, ignore_errors=True)
prefix, folder = work / "prefix", work / "a folder"
folder.mkdir(parents=True)
share = prefix / "share"
# A desktop that knows of its own types and of those in the prefix, and of no user.
environment = {**os.environ, "HOME": str(work), "XDG_DATA_HOME": str(work / "data"), "XDG_CONFIG_HOME": str(work),
               "XDG_DATA_DIRS": f"{share}:/usr/share", "XDG_CURRENT_DESKTOP": "GNOME",
               "PATH": f"{prefix / 'bin'}:{os.environ['PATH']}"}


def run(*command):
    return must(*command, env=environment)


def entry(path):
    """The first group of a key file."""
    parser = configparser.ConfigParser(interpolation=None, delimiters="=")
    parser.optionxform = str
    parser.read(path)
    return parser[parser.sections()[0]]


def check_files():
    run("update-mime-database", share / "mime")
    icons = share / "icons" / "hicolor" / "scalable"
    xml.etree.ElementTree.parse(icons / "mimetypes" / "model-vnd.pbm.pbvg.svg")
    if not (share / "applications").is_dir():  # a build without the viewer
        return
    desktop = share / "applications" / "pbm-view.desktop"
    said = run("desktop-file-validate", desktop)
    check(not said, said)
    run("update-desktop-database", share / "applications")
    run("appstreamcli", "validate", "--no-net", share / "metainfo" / "org.pbm.view.metainfo.xml")
    check((icons / "apps" / (entry(desktop)["Icon"] + ".svg")).is_file(), "the application has no icon")
    check(shutil.which(entry(desktop)["TryExec"], path=prefix / "bin"), "the application's program is not installed")
    check("pbm-view.desktop" in run("gio", "mime", MODEL_TYPE), "no application opens models")


def check_types(model):
    for name in ("model.pbvg", "model.bvg", "by magic"):
        file = folder / name
        if file != model:
            shutil.copy(model, file)
        check(run("xdg-mime", "query", "filetype", file).strip() == MODEL_TYPE, f"xdg-mime: {name} has another type")
        told = run("gio", "info", "-a", "standard::content-type,standard::icon", file)
        check(f"content-type: {MODEL_TYPE}" in told and "model-vnd.pbm.pbvg" in told, f"gio: {name}: {told}")
    text = folder / "text"
    text.write_text("BVG\n")
    check(run("xdg-mime", "query", "filetype", text).strip() == "text/plain", "a text has another type")


def thumbnail(exec_line, model, size):
    """As file managers do: the picture has a name of theirs, and is there before it is drawn."""
    picture = work / f"thumbnail.{size}"
    picture.touch()
    values = {"%i": str(model), "%o": str(picture), "%s": str(size), "%u": model.as_uri(), "%%": "%"}
    words = [values.get(word, word) for word in shlex.split(exec_line)]
    process = subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    said = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    return os.waitstatus_to_exitcode(status), said, usage.ru_maxrss * 1024, picture


def check_thumbnails(models):
    thumbnailer = entry(share / "thumbnailers" / "pbm.thumbnailer")
    check(shutil.which(thumbnailer["TryExec"], path=prefix / "bin"), "the thumbnailer is not installed")
    check(MODEL_TYPE in thumbnailer["MimeType"], "the thumbnailer is for other files")
    for model in models:
        for size in (128, 256, 512, 1024):
            code, said, memory, picture = thumbnail(thumbnailer["Exec"], model, size)
            what = f"{model.name}, {size} pixels, {memory / 1e6:.0f} MB"
            print(what)
            check(code == 0 and not said, f"{what}: {code} {said}")
            edges = struct.unpack(">II", picture.read_bytes()[16:24])
            check(edges == (size, size), f"{what}: is {edges}")
            check(memory < THUMBNAIL_MEMORY, f"{what}: too much memory")
        width, height, channels, pixels = read_png(work / "thumbnail.128")
        check(channels == 4, f"{model.name}: not transparent")
        drawn = sum(alpha > 0 for alpha in pixels[3::4])
        check(width * height // 20 < drawn < width * height, f"{model.name}: {drawn} pixels are drawn")
    # What does not fit is drawn coarser, and refused for other pictures.
    fine = ["pbm-render", models[1], "-o", work / "fine.png", "--max-error", "0.1", "--json"]
    points = [json.loads(run(*fine, "--thumbnail", "256", "--max-memory", limit))["points"]
              for limit in ("2400k", "1G")]
    check(0 < points[0] < points[1], f"thumbnails with less and with more memory show {points} points")
    code = subprocess.run([*fine, "--resolution", "256,256", "--max-memory", "2400k"], env=environment,
                          capture_output=True).returncode
    check(code == 4, f"a picture that does not fit ends with {code}")
    damaged, whole = folder / "damaged.pbvg", models[0].read_bytes()
    damaged.write_bytes(whole[: len(whole) // 2])
    code, said, _, picture = thumbnail(thumbnailer["Exec"], damaged, 256)
    check(code == 3 and said.count(b"\n") == 1, f"a damaged model: {code} {said}")


def main():
    run(cmake, "--install", build, "--prefix", prefix, "--component", "pbm-tools")
    if (build / "bin" / "pbm-view").exists():
        run(cmake, "--install", build, "--prefix", prefix, "--component", "pbm-viewer")
    check_files()
    programs = prefix / "bin"
    # The second model is denser than thumbnails show; the third is drawn from the mapped file.
    models = [folder / name for name in ("model.pbvg", "dense.pbvg", "-mapped.pbvg")]
    run(programs / "pbm-sample", "-q", "--vertices", "20000", "-o", folder / "scan.ply")
    run(programs / "pbm-sample", "-q", "--shape", "statue", "--points", "400000", "-o", folder / "dense.ply")
    run(programs / "pbm-build", "-q", folder / "scan.ply", "--depth", "8", "-o", models[0])
    run(programs / "pbm-build", "-q", folder / "dense.ply", "--depth", "10", "-o", models[1])
    run(programs / "pbm-build", "-q", folder / "dense.ply", "--depth", "10", "--store", "mapped", "-o", models[2])
    check_types(models[0])
    check_thumbnails(models)


main()
