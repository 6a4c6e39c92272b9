#!/usr/bin/env python3
"""A model is never taken for that of other files: when two files that a scan names trade contents, when one disappears,
appears, or is found in another place, --if-changed, --cache, --action-key, --batch, parts and the cache of pbm-render
give what a fresh build gives, or fail: check_sources.py PROGRAMS WORK"""

import os
import pathlib
import shutil
import signal
import subprocess
import sys

import scans

programs, work = (pathlib.Path(word).resolve() for word in sys.argv[1:])
work = work / "sources"
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
faults = []


def expect(condition, what):
    if not condition:
        faults.append(what)


def run(*words, folder, exit_code=0):
    done = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True,
                          env={**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"})
    expect(done.returncode == exit_code, f"{folder.name}: {words}: exit code {done.returncode}: {done.stderr}")
    return done.stdout


class Scan:
    def __init__(self, write):
        self.folder = work / write.__name__
        self.folder.mkdir()
        self.name, self.named = write(self.folder)
        self.options = ["--depth", "6", "-q"]
        self.known = {}  # models of states of the files, by kind

    def build(self, *words, exit_code=0):
        return run("pbm-build", self.name, *self.options, *words, folder=self.folder, exit_code=exit_code)

    def bytes_of(self, file):
        path = self.folder / file
        return path.read_bytes() if path.exists() else b""

    def step(self, what):
        """Everything that may take an older model for this one."""
        name = f"{self.folder.name}: {what}"
        self.build("-o", "fresh.pbvg")
        self.build("-o", "recorded.pbvg", "--source-hash")
        plain, recorded = self.bytes_of("fresh.pbvg"), self.bytes_of("recorded.pbvg")
        self.build("-o", "model.pbvg", "--if-changed")
        expect(self.bytes_of("model.pbvg") == recorded, f"{name}: --if-changed keeps another model")
        self.build("-o", "cached.pbvg", "--cache", "cache")
        expect(self.bytes_of("cached.pbvg") == plain, f"{name}: --cache gives another model")
        key = self.build("--action-key")
        expect(self.known.setdefault(key, plain) == plain, f"{name}: two models have one --action-key")
        (self.folder / "list").write_text(self.name + "\n")
        run("pbm-build", "--batch", "list", "--output-dir", "batch", "--if-changed", *self.options, folder=self.folder)
        expect(self.bytes_of("batch/scan.pbvg") == recorded, f"{name}: --batch keeps another model")
        self.build("-o", "parts.pbvg", "--shard", "0/2")
        self.build("-o", "parts.pbvg", "--shard", "1/2")
        self.build("-o", "parts.pbvg", "--merge", "2")
        expect(self.bytes_of("parts.pbvg") == plain, f"{name}: parts give another model")
        pictures = []
        for cache in ("pictures", "none"):
            run("pbm-render", "-q", self.name, "--cache", cache, "--resolution", "64,64", "-o", "scan.png",
                folder=self.folder)
            pictures.append(self.bytes_of("scan.png"))
        expect(pictures[0] == pictures[1], f"{name}: the cache of pbm-render keeps another model")
        return plain

    def exchange(self):
        """The two files that the scan names trade contents and keep their times."""
        a, b = (self.folder / name for name in self.named)
        a.rename(self.folder / "between")
        b.rename(a)
        (self.folder / "between").rename(b)


for write in (scans.write_obj, scans.write_gltf, scans.write_ply, scans.write_alignment):
    scan = Scan(write)
    first = scan.step("at first")
    # One part before the files change, the other behind it.
    scan.build("-o", "parts.pbvg", "--shard", "0/2")
    scan.exchange()
    scan.build("-o", "parts.pbvg", "--shard", "1/2")
    scan.build("-o", "parts.pbvg", "--merge", "2", exit_code=3)
    expect(scan.bytes_of("parts.pbvg") == first, f"{write.__name__}: parts of two scans become a model")
    expect(scan.step("contents exchanged") != first, f"{write.__name__}: nothing is tested")
    scan.exchange()
    expect(scan.step("exchanged again") == first, f"{write.__name__}: the first model is lost")
    if write is scans.write_alignment:
        continue
    # A file that is gone, back, and back in another place and spelling.
    b = scan.folder / scan.named[1]
    b.rename(scan.folder / "away")
    expect(scan.step("a file is gone") != first, f"{write.__name__}: nothing is tested")
    (scan.folder / "away").rename(scan.folder / "B.PNG")
    expect(scan.step("a file is there in capital letters") == first, f"{write.__name__}: capital letters matter")
    b.write_bytes(scans.RED)
    expect(scan.step("two spellings are there") != first, f"{write.__name__}: nothing is tested")
    b.unlink()
    scan.step("one spelling is there")

# A scan that changes while it is read.
folder = work / "changing"
folder.mkdir()
run("pbm-sample", "--quiet", "--vertices", "500000", "-o", "scan.ply", folder=folder)
(folder / "model.pbvg").write_text("the old model")


def touch(path):
    os.utime(path, ns=(0, path.stat().st_mtime_ns + 1))


def rewrite(path):
    """A bit of a vertex in place; the size and the time of modification stay."""
    before = path.stat()
    with path.open("r+b") as file:
        file.seek(1000)
        byte = file.read(1)[0]
        file.seek(1000)
        file.write(bytes([byte ^ 1]))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


for change, words in ((touch, ["-o", "model.pbvg"]), (touch, ["-o", "model.pbvg", "--shard", "0/2"]),
                      (rewrite, ["-o", "model.pbvg"]), (rewrite, ["-o", "model.pbvg", "--cache", "cache"])):
    build = subprocess.Popen([programs / "pbm-build", "scan.ply", "--depth", "9", "--progress", "-MF", "model.d", *words],
                             cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    build.stdout.readline()
    build.send_signal(signal.SIGSTOP)
    change(folder / "scan.ply")
    build.send_signal(signal.SIGCONT)
    said = build.communicate()[1]
    expect(build.returncode == 2 and "scan.ply: changed while it was read" in said,
           f"a scan that changes while it is read: {words}: exit code {build.returncode}: {said}")
    expect(sorted(path.name for path in folder.iterdir() if path.is_file()) == ["model.pbvg", "scan.ply"] and
           (folder / "model.pbvg").read_text() == "the old model" and not list(folder.glob("cache/*.pbvg")),
           f"a scan that changes while it is read leaves something: {words}")

# Material files on a continued line, and more images than a scan usually has.
folder = work / "continued"
folder.mkdir()
name, named = scans.write_obj(folder)
text = (folder / name).read_text().replace("mtllib scan.mtl", "mtllib first.mtl \\\n scan.mtl")
(folder / name).write_text(text)
(folder / "first.mtl").write_text("".join(f"newmtl m{i}\nmap_Kd none{i}.png\n" for i in range(300)))
dependencies = run("pbm-build", name, "--depth", "6", "-q", "-MF", "-", "-o", "model.pbvg", folder=folder)
for file in ("first.mtl", "scan.mtl", *named):
    expect(f"  {file}" in dependencies, f"{file} is no dependency of an OBJ with a continued line:\n{dependencies}")

print("\n".join(faults + [f"{len(faults)} faults"]))
sys.exit(1 if faults else 0)
