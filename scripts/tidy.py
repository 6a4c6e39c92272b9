#!/usr/bin/env python3
"""clang-tidy of our own sources: tidy.py BUILD_FOLDER [FILE...]. Exit code 1: it found something.

Nine tenths of what clang-tidy does to a file it does to the headers of others. Files are therefore looked at together,
six dozen at a time, as if they were one, with the folders and macros of all of them. Their headers come first; then each
file's own names get its number, so that they differ from those of the others. Where that finds anything, or where files
do not go together, they are looked at in halves and in the end alone, with their own flags, and only that counts.
Files whose text and flags passed before are skipped: BUILD_FOLDER/tidy has stamps.
"""
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDERS = ("system", "format_spec", "command_line", "runtime", "tools", "data", "bindings", "tests", "bench", "examples")
TOGETHER = 72
HEADERS = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.h"))
SPARED = {"bench/programs/cgal_peer.cpp"}  # CGAL's headers take as long as all of pbm_format
ANYWHERE = {"hn", "to_json"}  # the same alias in all files of Highway; what nlohmann_json looks for
STATIC_SIMD = ("-DHWY_COMPILE_ONLY_STATIC", "-march=haswell", "-maes")


def sources_of(build):
    """Our files -> the flags of the first target that compiles them."""
    flags = {}
    for entry in json.loads((build / "compile_commands.json").read_text(encoding="utf-8")):
        unit = pathlib.Path(entry["file"])
        paths = [unit]
        if unit.parent.name == "Unity":
            paths = map(pathlib.Path, re.findall(r'#include "(.*)"', unit.read_text(encoding="utf-8")))
        ours = [path.resolve() for path in paths]
        ours = [path.relative_to(ROOT) for path in ours if path.is_relative_to(ROOT)]
        words, kept = shlex.split(entry["command"]), []
        at = 1
        while at < len(words):
            if words[at] == "-o":
                at += 1
            elif words[at] != "-c" and words[at] != entry["file"] and words[at].startswith("-"):
                if words[at] == "-include":  # precompiled by another compiler
                    at += 1
                elif words[at] == "-isystem":
                    at += 1
                    kept += words[at - 1:at + 1]
                elif words[at] != "-Winvalid-pch" and not words[at].startswith("--param"):  # g++ alone knows them
                    kept.append(words[at])
            at += 1
        for path in ours:
            if path.parts[0] in FOLDERS and str(path) not in flags and str(path) not in SPARED:
                flags[str(path)] = tuple(kept)
    return flags


class Names:
    """`own`: what a file alone may call so, once its number is added; `shared`: what else it declares for itself, and no
    file beside it may declare or call; `calls`: what it calls by no more than a name."""

    def __init__(self, file):
        text = (ROOT / file).read_text(encoding="utf-8")
        declared = declared_in(text)
        elsewhere = set(re.findall(r"(?:\.|->|::|#define )(\w+)", text))  # a member, or a name of another namespace
        for header in re.findall(r'#include "(.*\.h)"', text):
            for found in headers_named(file, header):  # may have overloads
                elsewhere.update(re.findall(r"\b(\w+)\(", found.read_text(encoding="utf-8")))
        self.own = declared - elsewhere - ANYWHERE
        self.shared = declared - self.own - ANYWHERE
        self.calls = set(re.findall(r"(?<![.>:\w])(\w+)\(", text)) - self.own


def headers_named(file, name):
    """Headers of ours that `file` may mean by `name`."""
    beside = (ROOT / file).parent / name
    return [beside] if beside.exists() else [path for path in HEADERS if str(path).endswith("/" + name)]


def declared_in(text):
    """Names in unnamed namespaces and in those of SIMD targets, roughly: line by line."""
    names = set()
    for inside in re.findall(r"^namespace (?:[\w:]+::HWY_NAMESPACE )?\{$(.*?)^\} // namespace", text, re.MULTILINE | re.DOTALL):
        for line in re.findall(r"^(?!using (?!\w+ =)|static_assert|[A-Z_]{4,}\()[a-zA-Z].*", inside, re.MULTILINE):
            found = re.search(r"^(?:struct|class|enum(?: class)?) (\w+)|\b([a-zA-Z_]\w*)(?= = |\(|\{|\[|;)", line)
            names.update(found.groups() if found else ())
            names.update(re.findall(r", ([a-zA-Z_]\w*)(?= = )", line))
    return names - {None}


def included_by(file):
    """The lines that include headers at the start of a file, for a file in another folder."""
    lines = []
    for line in (ROOT / file).read_text(encoding="utf-8").splitlines():
        if found := re.match(r'#include ([<"])(.*)[>"]', line):
            beside = (ROOT / file).parent / found[2]
            lines.append(f'#include "{beside}"' if found[1] == '"' and beside.exists() else line)
        elif line and not line.startswith("//"):
            break
    return lines


def text_together(files):
    """A file that includes all of them."""
    texts = {file: (ROOT / file).read_text(encoding="utf-8") for file in files}
    plain = [file for file, text in texts.items() if "foreach_target.h" not in text]
    lines = list(dict.fromkeys(line for file in plain for line in included_by(file)))
    for number, file in enumerate(files):
        names = sorted(Names(file).own | {"main", "LLVMFuzzerTestOneInput"})
        lines += [f"#define {name} {name}_{number}" for name in names]
        lines.append(f'#include "{ROOT / file}" // NOLINT')
        lines += [f"#undef {name}" for name in names]
    return "".join(line + "\n" for line in lines)


def flags_together(some):
    """Flags for files with `some` flags: the folders and macros of all; None if a macro has two values, or if they are
    compiled for different machines."""
    folders, macros, others = [], {}, set()
    for flags in some:
        words, own = iter(flags), []
        for word in words:
            if word == "-isystem":
                folders.append((word, next(words)))
            elif word.startswith("-I"):
                folders.append((word,))
            elif word.startswith("-D"):
                name, _, value = word[2:].partition("=")
                if macros.setdefault(name, value) != value:
                    return None
            elif not re.match(r"-(O|f|g|MD|Werror)", word):  # says nothing about the language
                own.append(word)
        others.add(tuple(own))
    if len(others) != 1:
        return None
    together = [*others.pop(), *(f"-D{name}={value}" if value else f"-D{name}" for name, value in macros.items())]
    return tuple(together + [word for folder in dict.fromkeys(folders) for word in folder])


def groups_of(files, flags):
    """Lists of files to be looked at together, with flags; those that define functions of other libraries are alone, and
    files of Highway among themselves."""
    groups = []  # files, flags, names, calls, room
    for file in files:
        room = next(iter(re.findall(r"^tests/(?:unit|mutants)", file)), None)  # names of their own in headers
        text = (ROOT / file).read_text(encoding="utf-8")
        names = Names(file)
        alone = "<dlfcn.h>" in text
        if "foreach_target.h" in text:
            room = "Highway"
        for group in groups if not alone else ():
            if (group[4] == room and len(group[0]) < TOGETHER and not group[2] & (names.shared | names.calls)
                    and not group[3] & names.shared):
                if both := flags_together([group[1], flags[file]]) if group[1] else None:
                    group[1] = both
                    break
        else:
            group = [[], () if alone else flags[file], set(), set(), room]
            groups.append(group)
        group[0].append(file)
        group[2].update(names.shared)
        group[3].update(names.calls)
    return sorted(((group[0], group[1]) for group in groups), key=lambda group: len(group[0]), reverse=True)


def tidy(path, flags):
    """What clang-tidy says of it, nothing if all is well."""
    ours = f"^{re.escape(str(ROOT))}/({'|'.join(FOLDERS)})/"
    command = ["clang-tidy", "--quiet", f"--header-filter={ours}", str(path), "--", *flags, "-Wno-unknown-warning-option"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return run.stdout + run.stderr if run.returncode != 0 else ""


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    flags = sources_of(build)
    stamps = build / "tidy"
    stamps.mkdir(exist_ok=True)
    # All that can change the verdict of a file: all headers, the configuration, its flags, the file itself.
    common = b"".join(path.read_bytes() for path in [ROOT / ".clang-tidy", *HEADERS])

    def stamp_of(file):
        text = common + repr(flags[file]).encode() + (ROOT / file).read_bytes()
        return stamps / file.replace("/", "_"), hashlib.sha256(text).hexdigest()

    def passed(file):
        stamp, digest = stamp_of(file)
        return stamp.exists() and stamp.read_text() == digest

    def look_at(group):
        """What is wrong with them; whoever passes gets a stamp."""
        members, together_flags = group
        if len(members) == 1:
            said = tidy(ROOT / members[0], flags[members[0]])
        else:
            digest = hashlib.sha256("\n".join(members).encode()).hexdigest()[:16]
            together = stamps / f"{digest}.cpp"
            together.write_text(text_together(members))
            # Files of Highway include themselves once per target: together they do so for one. What one file declares
            # may hide what the next one does; compilers see each of them alone.
            if apart := tidy(together, (*together_flags, *STATIC_SIMD, "-Wno-shadow")):
                half = len(members) // 2
                said = look_at((members[:half], together_flags)) + look_at((members[half:], together_flags))
                if not said and len(members) > TOGETHER // 2:  # their authors may want to know what costs this time
                    reason = next((line for line in apart.splitlines() if ": error: " in line), apart)
                    print(f"clang-tidy: {len(members)} files do not go together: {reason}", flush=True)
                return said
            said = ""
        for file in members if not said else ():
            stamp, digest = stamp_of(file)
            stamp.write_text(digest)
        return said

    asked = [os.path.relpath(os.path.realpath(file), ROOT) for file in sys.argv[2:]] or sorted(flags)
    if unknown := [file for file in asked if file not in flags]:
        sys.exit(f"no target compiles {', '.join(unknown)}")
    wanted = [file for file in asked if not passed(file)]
    groups = groups_of(wanted, flags)
    verdict = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for said in pool.map(look_at, groups):
            if said:
                print(said, flush=True)
                verdict = 1
    print(f"clang-tidy: {len(asked)} files, {len(wanted)} looked at, in {len(groups)} groups")
    return verdict


sys.exit(main())
