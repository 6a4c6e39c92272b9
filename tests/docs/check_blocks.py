#!/usr/bin/env python3
"""Runs the blocks of code of the README and of every page of docs/, as they stand there, each in a folder of its own:
check_blocks.py full|nightly ROOT BUILD LIBRARY WORK [PAGE...]

A folder holds those files of stock.py that the block names. A block that cannot be run stands in left_out.py with the
reason. Programs that wait for a person or need another machine are stand-ins: pbm-view reads its command line, finds no
display and ends; ssh, curl, sbatch and others do here what they would do elsewhere.
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

import left_out
import pieces
import stock

# Pages whose blocks take minutes.
NIGHTLY = ("docs/gallery.md", "docs/how-to/turntable-video.md")
# Pages whose blocks go on where the one before ended, in one folder.
CONTINUED = ("docs/tutorial/first-model.md", "docs/how-to/use-from-c.md", "docs/how-to/use-the-libraries.md",
             "docs/how-to/validate-in-a-pipeline.md", "docs/how-to/prepare-scans.md")
# Pages that make their own scan, so that what they print is compared to the digit, but for times.
EXACT = ("docs/tutorial/first-model.md", )

STAND_INS = {
    "pbm-view": """unset DISPLAY WAYLAND_DISPLAY
[ -x @programs@/pbm-view ] || exit 0
@programs@/pbm-view "$@" >/dev/null 2>pbm-view.errors && exit
[ $? = 4 ] || { cat pbm-view.errors >&2; exit 1; }""",
    "ssh": 'shift; exec "$@"',
    "curl": 'for address; do :; done; exec cat "${address##*/}"',
    "less": "exec cat >/dev/null",
    "ffmpeg": 'cat >/dev/null; for file; do :; done; echo video >"${file#file:}"',
    "sbatch": 'for word; do case $word in *.slurm) bash -n "$word" || exit;; esac; done; echo 7',
    "python3": '[ "$1 $2 $3" != "-m http.server -d" ] || exec test -e "$4/index.html"; exec @python@ "$@"',
    "window.sh": 'picture=$1; shift 2; pbm-view "$@"; echo picture >"$picture"',
}

NEEDS = {"jq": ["jq"], "ninja": ["ninja"], "meson": ["meson", "ninja"], "make": ["make"], "cmake": ["cmake", "ninja"]}


class Block:
    def __init__(self, page, number, language, text):
        self.page, self.number, self.language, self.text = page, number, language, text

    def __str__(self):
        return f"{self.page}, block {self.number} ({self.language}: {self.text.strip().splitlines()[0][:60]})"


class Checker:
    def __init__(self, root, build, library, work):
        self.root, self.build, self.work = root, build, work
        self.stock, self.prefix = work / "stock", work / "prefix"
        shutil.rmtree(work, ignore_errors=True)
        self.stock.mkdir(parents=True)
        stock.make(root, build / "bin", self.stock)
        self.bin = work / "bin"
        self.bin.mkdir()
        for name, script in STAND_INS.items():
            script = script.replace("@programs@", str(build / "bin")).replace("@python@", sys.executable)
            (self.bin / name).write_text("#!/bin/sh\n" + script + "\n")
            (self.bin / name).chmod(0o755)
        web = work / "web"  # of another compiler: a viewer of one file
        web.mkdir()
        shutil.copy(root / "bindings/web/page/page.html", web)
        (web / "pbm-viewer.js").write_text("viewer")
        (web / "page_files.txt").write_text("pbm-viewer.js 40\n")
        self.environment = {
            **{name: value for name, value in os.environ.items() if not name.startswith(("PBM_", "XDG_"))},
            "PATH": f"{self.bin}:{build / 'bin'}:{os.environ['PATH']}", "PBM_WEB": str(web), "GALLERY": str(self.bin),
            "PBM_REMOTE": "remote", "PBM_LIBRARY": str(library), "PYTHONPATH": str(root / "bindings/python"),
            "PYTHONDONTWRITEBYTECODE": "1", "CMAKE_PREFIX_PATH": str(self.prefix), "CMAKE_GENERATOR": "Ninja",
            "no_proxy": "127.0.0.1",
        }
        self.faults, self.ran, self.skipped, self.unused = [], 0, [], {entry[:2] for entry in left_out.LEFT_OUT}

    def blocks(self, pages):
        for page in pages:
            text = (self.root / page).read_text()
            for number, match in enumerate(re.finditer(r"^```(\w*)\n(.*?)^```$", text, re.M | re.S), 1):
                yield Block(page, number, match[1], match[2])

    def reason(self, block):
        """Why the block is left out, or None."""
        for page, piece, why in left_out.LEFT_OUT:
            if page == block.page and piece in block.text:
                self.unused.discard((page, piece))
                return why
        return "holds no commands" if block.language in left_out.NO_COMMANDS else None

    def folder(self, block):
        name = re.sub(r"\W+", "_", block.page) + ("" if block.page in CONTINUED else f"_{block.number}")
        folder = self.work / name
        folder.mkdir(exist_ok=True)
        named = {path for path in self.stock.iterdir()
                 if re.search(rf"(?<![\w.-]){re.escape(path.name)}(?![\w-]|\.\w)", block.text)}
        if re.search(r"lion\.toml", block.text):
            named.add(self.stock / "lion.ply")
        if "bun.conf" in block.text:
            named |= {self.stock / "front.ply", self.stock / "back.ply"}
        for path in named:
            if not (folder / path.name).exists():
                (shutil.copytree if path.is_dir() else shutil.copy)(path, folder / path.name)
        if re.search(r"build/release|\bexamples\b", block.text) and not (folder / "build").exists():
            release = folder / "build/release"  # a build of the sources, whose pbm-view is a stand-in
            (release / "bin").mkdir(parents=True)
            for path in [*self.build.iterdir(), *(self.build / "bin").iterdir()]:
                link = release / path.relative_to(self.build)
                if not link.exists():
                    link.symlink_to(self.bin / "pbm-view" if path.name == "pbm-view" else path)
            (folder / "examples").symlink_to(self.root / "examples")
        for page, piece, commands in stock.BEFORE:
            if page == block.page and piece in block.text:
                self.run(block, folder, "bash", "-euc", commands)
        return folder

    def run(self, block, folder, *command):
        environment = {**self.environment, "HOME": str(folder)}
        try:
            done = subprocess.run([str(word) for word in command], cwd=folder, env=environment, text=True, errors="replace",
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=900)
        except subprocess.TimeoutExpired:
            self.faults.append(f"{block}: does not end")
            return ""
        except FileNotFoundError as missing:  # what a command before should have made
            self.faults.append(f"{block}: {missing}")
            return ""
        if done.returncode != 0:
            self.faults.append(f"{block}: exit code {done.returncode}\n{done.stdout}")
        return done.stdout

    # A function for each language.

    def sh(self, block, folder):
        lines = block.text.splitlines()
        if all(line.startswith("--") for line in lines):  # options
            lines = [f"pbm-build scan.ply {line.split(' #')[0]} --depth 6 -q -o model.pbvg" for line in lines]
            shutil.copy(self.stock / "scan.ply", folder)
        self.run(block, folder, "bash", "-euc", "\n".join(lines))

    def console(self, block, folder):
        commands = []  # each with what the page says that it prints
        for line in block.text.splitlines():
            if line.startswith("$ "):
                commands.append((line[2:], []))
            else:
                commands[-1][1].append(line)
        if block.page not in EXACT and "lion.pbvg" in block.text and "INVALID" in block.text:
            shutil.copy(self.stock / "damaged lion", folder / "lion.pbvg")
        script = ""
        for number, (command, _) in enumerate(commands):
            script += f"status=$?; printf '\\nMARK %d %d\\n' {number} $status; (exit $status)\n{command}\n"
        said = self.run(block, folder, "bash", "-c", script + "status=$?; printf '\\nMARK 0 %d\\n' $status; exit 0")
        parts = re.split(r"\nMARK \d+ (\d+)\n", said)
        for number, (command, expected) in enumerate(commands):
            found, status = parts[2 * number + 2], parts[2 * number + 3]
            following = commands[number + 1][0] if number + 1 < len(commands) else ""
            if status != "0" and following != "echo $?" and "INVALID" not in found:
                self.faults.append(f"{block}: {command}: exit code {status}\n{found}")
            if expected and not re.fullmatch(self.pattern("\n".join(expected), block.page in EXACT), " ".join(found.split())):
                self.faults.append(f"{block}: {command} prints\n{found}and not\n" + "\n".join(expected))

    @staticmethod
    def pattern(text, is_exact):
        numbers = r"\d[\d.]*(?= m?s\b)" if is_exact else r"0x[0-9a-f]+|\d[\d.]*"
        pieces = re.split(rf"({numbers}|\.\.\.)", " ".join(text.split()))
        return "".join(".*?" if piece == "..." else r"[\dxa-f.]+" if index % 2 else re.escape(piece)
                       for index, piece in enumerate(pieces))

    def json(self, block, folder):
        try:
            import jsonschema
        except ModuleNotFoundError:
            return self.skipped.append(f"{block}: the Python package jsonschema is missing")
        document = json.loads(block.text)
        name = "tools/pbm-validate/report" if "files" in document else "command_line/failure"
        schema = json.loads((self.root / f"{name}.schema.json").read_text())
        for error in jsonschema.Draft202012Validator(schema).iter_errors(document):
            self.faults.append(f"{block}: {error.json_path}: {error.message}")

    def toml(self, block, folder):
        (folder / "recipe.toml").write_text(block.text)
        self.run(block, folder, "pbm-build", "--recipe", "recipe.toml")
        self.run(block, folder, "pbm-validate", "lion.pbvg")

    def make(self, block, folder):
        (folder / "Makefile").write_text(block.text)
        self.run(block, folder, "make")
        if "up to date" not in self.run(block, folder, "make"):
            self.faults.append(f"{block}: builds twice")

    def meson(self, block, folder):
        (folder / "meson.build").write_text(pieces.MESON_HEAD + block.text)
        self.run(block, folder, "meson", "setup", "build")
        self.run(block, folder, "ninja", "-C", "build")

    def cmake(self, block, folder):
        folder = folder / f"cmake {block.number}"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        shutil.copytree(self.stock / "scans", folder / "scans")
        (folder / "CMakeLists.txt").write_text(pieces.CMAKE_HEAD + block.text)
        self.run(block, folder, "cmake", "-S", ".", "-B", "build")
        if "pbm_add_asset" in block.text:
            self.run(block, folder, "cmake", "--build", "build")

    def compile(self, block, folder, text):
        target = {"c": "pbm::c", "cpp": "pbm::format"}[block.language]
        (folder / f"block.{block.language}").write_text(text)
        (folder / "CMakeLists.txt").write_text(pieces.CMAKE_HEAD + "find_package(pbm REQUIRED)\n"
                                               f"add_executable(block block.{block.language})\n"
                                               f"target_link_libraries(block PRIVATE {target})\n")
        self.run(block, folder, "cmake", "-S", ".", "-B", "program", "-DCMAKE_C_FLAGS=-Wall -Wextra -Werror")
        self.run(block, folder, "cmake", "--build", "program", "--target", "block")
        self.run(block, folder, "program/block")

    def programs(self, blocks):
        """Pieces of one program each: those in C, C++ and Python of a page."""
        by_page = {}
        for block in blocks:
            by_page.setdefault((block.page, block.language), []).append(block)
        for (_, language), several in by_page.items():
            first, texts = several[0], [block.text for block in several]
            folder = self.folder(first)
            for name in ("scan.pbvg", "bust.pbvg", "left.e57", "right.e57"):
                shutil.copy(self.stock / name, folder)
            self.ran += len(several)
            if language == "python":
                (folder / "block.py").write_text(pieces.PYTHON + "\n".join(texts))
                self.run(first, folder, sys.executable, "-B", "block.py")
            elif language == "cpp":
                self.compile(first, folder, pieces.CPP.replace("@", re.sub(r"#include.*\n", "", texts[0])))
            else:
                head, opening = texts[0].split("\n\n", 1)
                text = pieces.C.replace("@0@", head).replace("@open@", opening + "pbm_code code_of_opening;")
                for number in range(1, len(texts)):
                    text = text.replace(f"@{number}@", texts[number])
                self.compile(first, folder, text)

    def check(self, pages):
        together = []
        for block in self.blocks(pages):
            missing = [name for word, names in NEEDS.items() if re.search(rf"\b{word}\b", block.language + " " + block.text)
                       for name in names if not shutil.which(name)]
            if self.reason(block):
                continue
            if missing:
                self.skipped.append(f"{block}: not installed: {' '.join(missing)}")
            elif block.language in ("c", "cpp", "python"):
                together.append(block)
            elif not hasattr(self, block.language):
                self.faults.append(f"{block}: no way to run it, and left_out.py does not name it")
            else:
                self.ran += 1
                getattr(self, block.language)(block, self.folder(block))
        self.programs(together)


def main():
    label, (root, build, library, work) = sys.argv[1], (pathlib.Path(word).resolve() for word in sys.argv[2:6])
    pages = sys.argv[6:] or ["README.md", *sorted(str(path.relative_to(root)) for path in (root / "docs").rglob("*.md"))]
    pages = [page for page in pages if (page in NIGHTLY) == (label == "nightly")]
    checker = Checker(root, build, library, work)
    subprocess.run(["cmake", "--install", build, "--prefix", checker.prefix], check=True, capture_output=True)
    checker.check(pages)
    stale = [f"left_out.py names a block that is not there: {page}: {piece}"
             for page, piece in sorted(checker.unused) if page in pages]
    print("\n".join(checker.skipped + checker.faults + stale))
    print(f"{checker.ran} blocks ran, {len(checker.skipped)} skipped, {len(checker.faults + stale)} faults")
    return 1 if checker.faults or stale or not checker.ran else 0


if __name__ == "__main__":
    sys.exit(main())
