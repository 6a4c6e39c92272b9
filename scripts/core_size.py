#!/usr/bin/env python3
"""Counts the smallest closed set that opens a file, decodes it and draws it with the reference renderer. Builds it in
build/core first.

The set is what the linker takes from our libraries for examples/draw_picture.cpp, and every header of ours that these
sources include. Prints lines per room.
"""
import collections
import json
import pathlib
import re
import shlex
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "examples/draw_picture.cpp"
LIBRARIES = ("pbm_render", "pbm_surface", "pbm_reading", "pbm_system", "pbm_base")


def main():
    build = ROOT / "build/core"
    subprocess.run(["cmake", "--preset", "core", "-DPBM_BUILD_SYSTEM=ON"], check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", build], check=True, stdout=subprocess.DEVNULL)
    commands = {}  # (library, object) -> how its source is compiled
    for entry in json.loads((build / "compile_commands.json").read_text(encoding="utf-8")):
        found = re.search(r"CMakeFiles/(\w+)\.dir/(?:.*/)?([^/]+\.o)$", entry.get("output", shlex.split(entry["command"])[-3]))
        if found:
            commands[found[1], found[2]] = entry
    archives = [str(next(build.rglob(f"lib{name}.a"))) for name in LIBRARIES]
    flags = [word for word in shlex.split(commands["pbm_render", "reference_renderer.cpp.o"]["command"])
             if re.match(r"-(I|isystem|std)", word) or word.startswith("/usr/include")]
    link = ["g++", *flags, f"-I{ROOT}/runtime", f"-I{ROOT}", str(PROGRAM), "-o", str(build / "core_size"),
            f"-Wl,-Map={build}/core_size.map", "-Wl,--start-group", *archives, "-Wl,--end-group", "-lzstd", "-lpthread"]
    subprocess.run(link, check=True)
    traced = (build / "core_size.map").read_text(encoding="utf-8")
    files = set()
    for archive, member in set(re.findall(r"lib(pbm_\w+)\.a\(([\w.]+\.o)\)", traced)):
        entry = commands[archive, member]
        words = [w for w in shlex.split(entry["command"]) if w not in ("ccache", "-c", "-MD")]
        for option in ("-o", "-MT", "-MF"):
            if option in words:
                at = words.index(option)
                del words[at:at + 2]
        rule = subprocess.run([*words, "-MM"], check=True, capture_output=True, text=True, cwd=entry["directory"]).stdout
        for name in rule.replace("\\\n", " ").split()[1:]:
            path = pathlib.Path(entry["directory"], name).resolve()
            if path.is_relative_to(ROOT) and not path.is_relative_to(build):
                files.add(path.relative_to(ROOT))
    rooms = collections.Counter()
    counts = collections.Counter()
    for path in files:
        rooms[str(path.parent)] += len((ROOT / path).read_text(encoding="utf-8").splitlines())
        counts[str(path.parent)] += 1
    for room in sorted(rooms):
        print(f"{room:44}{counts[room]:5} files{rooms[room]:7} lines")
    print(f"{'all':44}{len(files):5} files{sum(rooms.values()):7} lines")


main()
