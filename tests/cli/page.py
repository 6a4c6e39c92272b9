#!/usr/bin/env python3
"""Folders for web servers, as --page writes them: page.py PROGRAMS WORK_FOLDER SOURCE_FOLDER"""

import html.parser
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from commands import check, must  # noqa: E402

programs, work, source = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)

# A viewer of two files: the one that is built needs another compiler.
viewer = work / "viewer"
viewer.mkdir()
for form in ("page.html", "page.css"):
    shutil.copy(source / "bindings/web/page" / form, viewer)
files = {"pbm-viewer.js": (b"viewer", 40, ""), "pbm_threads.wasm": (b"threads", 2, " isolated"), "pbm.wasm": (b"wasm", 1000, "")}
for name, (content, _, _) in files.items():
    (viewer / name).write_bytes(content)
(viewer / "page_files.txt").write_text("".join(f"{name} {size}{use}\n" for name, (_, size, use) in files.items()))
environment = {**os.environ, "PBM_WEB": str(viewer.resolve())}


def run(program, *arguments):
    return must(programs / program, *arguments, cwd=work, env=environment, timeout=300)


def refused(code, message, program, *arguments, web=environment["PBM_WEB"]):
    result = subprocess.run([str(programs / program), *arguments], cwd=work, env={**environment, "PBM_WEB": web},
                            capture_output=True, text=True, timeout=300)
    check(result.returncode == code and message in result.stderr,
          f"{program} {arguments}: {result.returncode}, {result.stderr}")


class Page(html.parser.HTMLParser):
    """Attributes of the elements of a page, its title and heading, and what its metadata say."""

    def __init__(self, path):
        super().__init__()
        self.elements, self.texts, self.meta, self.inside = {}, {"title": "", "h1": ""}, {}, []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        self.elements[tag] = dict(attributes)
        if tag == "meta":
            known = dict(attributes)
            self.meta[known.get("name", known.get("property"))] = known.get("content")
        self.inside.append(tag)

    def handle_data(self, text):
        if self.inside and self.inside[-1] in self.texts:
            self.texts[self.inside[-1]] += text.strip()


def target(reference):
    return urllib.parse.unquote(reference.removeprefix("./").partition("?v=")[0])


run("pbm-sample", "--vertices", 10000, "-q", "-o", "a #1%.ply")
name = 'Lion "A" & <b> @MODEL@'
printed = run("pbm-build", "a #1%.ply", "--depth", 7, "--name", name, "--page", "site/of a scan")
folder = work / "site/of a scan"
check("site/of a scan/a #1%.pbvg: " in printed and "site/of a scan: a page that loads" in printed, "it says " + printed)
must(programs / "pbm-validate", folder / "a #1%.pbvg")
for file, (content, _, _) in files.items():
    check((folder / "pbm-viewer" / file).read_bytes() == content, file + " is not that of the viewer")
for poster in ("poster.jpg", "poster-turned.jpg"):
    check((folder / "pbm-viewer" / poster).read_bytes()[:3] == b"\xff\xd8\xff", f"{poster} is no JPEG")
page = Page(folder / "index.html")
shown = page.elements["pbm-viewer"]
check(page.texts == {"title": name, "h1": name} and shown["alt"] == name, f"the page is called {page.texts}")
check(target(shown["src"]) == "a #1%.pbvg", f"it shows {shown}")
check("controls" in shown and (shown.get("interaction-prompt"), shown.get("touch-action")) == ("auto", "none"),
      f"it says nobody how to turn the model, or turns and scrolls at once: {shown}")
posters = [page.elements["img"]["src"], page.elements["source"]["srcset"]]
check([target(poster) for poster in posters] == ["pbm-viewer/poster.jpg", "pbm-viewer/poster-turned.jpg"], f"posters: {posters}")
check(page.elements["html"]["lang"] == "en" and "main" in page.elements, "language or main part is missing")
check(page.meta["description"].startswith(name + ": a 3D scan") and page.meta["og:title"] == name
      and page.meta["og:image"] == posters[0], f"metadata: {page.meta}")
check("style" not in page.elements and not any(key == "style" or key.startswith("on") or (value or "").startswith("data:")
      for element in page.elements.values() for key, value in element.items()), "a strict policy forbids a part of the page")
check(target(page.elements["script"]["src"]).removeprefix("pbm-viewer/") in files, "the page loads another script")
check("@" not in (folder / "index.html").read_text().replace("@MODEL@", ""), "a place of the page is not filled")
check(not {"camera-orbit", "backs", "light-follows", "headlight", "colour-by"} & set(shown), "the default view is no view of its own")
names = sorted(path.name for path in folder.iterdir())
check(names == sorted(["index.html", "pbm-viewer", "a #1%.pbvg"]), f"it holds {names}")

# Again, of the model in the folder, which is left alone, and of a view.
before = (folder / "a #1%.pbvg").stat()
position, focus = (1.5, 0.25, 2), (0.25, 0.5, 0.125)
report = json.loads(run("pbm-render", folder.relative_to(work) / "a #1%.pbvg", "--page", folder.relative_to(work), "--json",
                        "--camera-position=%s,%s,%s" % position, "--camera-focal-point=%s,%s,%s" % focus,
                        "--camera-view-angle=20", "--backs=hide", "--light-follows=model", "--headlight=-45,22.5"))
after = (folder / "a #1%.pbvg").stat()
check((before.st_ino, before.st_mtime_ns) == (after.st_ino, after.st_mtime_ns), "the model was written over itself")
sizes = report["page"]
check(sizes["viewer_gzip_bytes"] == 1040 and sizes["threaded_viewer_gzip_bytes"] == 2, f"sizes of the viewer: {sizes}")
check(sizes["model_bytes"] == after.st_size, f"size of the model: {sizes}")
largest = max((folder / "pbm-viewer" / poster).stat().st_size for poster in ("poster.jpg", "poster-turned.jpg"))
check(sizes["poster_bytes"] == largest, f"size of the poster: {sizes}")
own = (folder / "index.html").stat().st_size + (folder / "pbm-viewer/page.css").stat().st_size
check(sizes["page_bytes"] == own and not sizes["page_kept"], f"size of the page: {sizes}")
viewed = [sizes[screen + "_model_bytes"] for screen in ("laptop", "phone", "4k")]
check(0 < viewed[0] <= viewed[1] <= viewed[2] <= sizes["model_bytes"], f"what visits cost: {sizes}")
shown = Page(folder / "index.html").elements["pbm-viewer"]
check((shown["backs"], shown["light-follows"], shown["headlight"]) == ("hide", "model", "-45deg 22.5deg"),
      f"the page shows other sides or lights: {shown}")
theta, phi, percent = (float(word.removesuffix("rad").removesuffix("%")) for word in shown["camera-orbit"].split())
# The element's 100 %: the sphere around the voxels of level 6 touches the nearer borders of the picture.
info = json.loads(run("pbm-info", folder.relative_to(work) / "a #1%.pbvg", "--json"))
text = run("pbm-export", folder.relative_to(work) / "a #1%.pbvg", "--level", 6, "--ascii", "-o", "-")
centres = [[float(word) for word in line.split()[:3]] for line in text.partition("end_header\n")[2].splitlines()]
voxel = info["voxel_size"] * 2 ** (info["depth"] - 6)
diagonal = math.dist([min(axis) for axis in zip(*centres)], [max(axis) + voxel for axis in zip(*centres)])
radius = percent / 100 * diagonal / 2 / math.sin(math.radians(10))
aim = [float(word) for word in shown["camera-target"].split()]
seen = [aim[0] + radius * math.sin(phi) * math.sin(theta), aim[1] + radius * math.cos(phi),
        aim[2] + radius * math.sin(phi) * math.cos(theta)]  # the sample's up axis is y
check(all(abs(a - b) < 1e-6 for a, b in zip(seen, position)), f"the orbit {shown} is at {seen}")
check(all(abs(a - b) < 1e-6 for a, b in zip(aim, focus)), f"the orbit {shown} is about {aim}")
check(abs(float(shown["field-of-view"].removesuffix("rad")) - math.radians(20)) < 1e-6, f"the angle is {shown}")

# In German, for an address. Addresses change with what they lead to, and with nothing else.
plain = Page(folder / "index.html")
run("pbm-render", folder.relative_to(work) / "a #1%.pbvg", "--page", folder.relative_to(work), "--page-lang=de", "-q",
    "--page-url=https://museum.example/lion")
german = Page(folder / "index.html")
check(german.elements["html"]["lang"] == "de" and ": ein 3D-Scan" in german.meta["description"], f"{german.meta}")
image = german.elements["img"]["src"]
check(german.meta["og:image"] == "https://museum.example/lion/" + image.removeprefix("./"), f"{german.meta}")
check(german.elements["pbm-viewer"]["src"] == plain.elements["pbm-viewer"]["src"], "the address of the same model is another")
check(image != plain.elements["img"]["src"], "another poster has the same address")
refused(1, "'e n' is no code of a language", "pbm-render", "site/of a scan/a #1%.pbvg", "--page", "site/of a scan", "--page-lang", "e n")

# A page that somebody edited stays, and what it shows is made anew; one that nobody edited is replaced.
index = folder / "index.html"
written = index.read_text(encoding="utf-8")
index.write_text(written.replace("<h1>", "<h1>My "), encoding="utf-8")
edited = index.read_bytes()
(folder / "pbm-viewer/poster.jpg").unlink()
printed = run("pbm-render", folder.relative_to(work) / "a #1%.pbvg", "--page", folder.relative_to(work))
check("index.html: somebody edited it" in printed and "remove it" in printed, "it says " + printed)
check(index.read_bytes() == edited and (folder / "pbm-viewer/poster.jpg").exists(), "an edited page was replaced")
index.unlink()
printed = run("pbm-render", folder.relative_to(work) / "a #1%.pbvg", "--page", folder.relative_to(work))
check("edited" not in printed and "on a phone (1170x2532)" in printed and index.exists(), "it says " + printed)

# What cannot be: nothing is written, and the model stays.
refused(2, "the viewer for web pages is not there", "pbm-render", "site/of a scan/a #1%.pbvg", "--page", "none", web="/nowhere")
check(not (work / "none").exists(), "a page without a viewer left a folder")
(work / "mine").mkdir()
(work / "mine/index.html").write_text("my page")
for arguments in (("pbm-render", "site/of a scan/a #1%.pbvg"), ("pbm-build", "a #1%.ply")):
    refused(2, "mine/index.html: --page did not write this file", *arguments, "--page", "mine")
    check([path.name for path in (work / "mine").iterdir()] == ["index.html"], f"{arguments[0]} wrote beside a foreign page")
refused(2, "the viewer for web pages is not there", "pbm-build", "a #1%.ply", "--page", "none", web="/nowhere")
(work / "broken.ply").write_text("ply\nformat ascii 1.0\nelement vertex 3\n")
refused(3, "broken.ply", "pbm-build", "broken.ply", "--page", "none")
check(not (work / "none").exists(), "a build that failed left a folder")
(work / "file").write_bytes(b"")
refused(2, "cannot make this folder", "pbm-render", "site/of a scan/a #1%.pbvg", "--page", "file")
refused(2, "cannot make this folder", "pbm-build", "a #1%.ply", "--page", "file")
refused(1, "--page needs an output with a name", "pbm-build", "a #1%.ply", "--page", "other", "-o", "-")
for view in ("--help", "--version", "--colour red"):
    refused(1, "makes no page" if view != "--colour red" else "--colour is not known", "pbm-build", "a #1%.ply", "--page", "early",
            "--page-view=" + view)
    check(not (work / "early").exists(), f"--page-view {view} is refused late")
refused(1, "--colour is not known", "pbm-build", "a #1%.ply", "--page", "site/of a scan", "--page-view", "--colour red")
must(programs / "pbm-validate", folder / "a #1%.pbvg")
print("passed")
