#!/usr/bin/env python3
"""No two files define a type of the same name in the same namespace: check_names.py SOURCE_FOLDER

The language leaves undefined what happens then, and neither compilers nor linkers say a word: functions of the one type are
taken for those of the other. Namespaces without a name are each file's own.
"""
import collections
import pathlib
import re
import sys

FOLDERS = ("system", "format_spec", "command_line", "runtime", "tools", "data", "bindings")
IGNORED = re.compile(r'//[^\n]*|"(?:\\.|[^"\\\n])*"|template\s*<[^{};]*?>\s*(?=class|struct|using|inline|constexpr|[A-Z])')
TOKENS = re.compile(r"namespace\s*([\w:]*)\s*\{|\b(?:struct|class|enum class|enum|union)\s+([\w:]+)[^;{}()=]*\{|[{}]")


def types_of(text):
    """Qualified names of the types that a file defines for others to see."""
    names, around = [], []  # `around`: a name for each open brace, None: a function or an initialiser
    for token in TOKENS.finditer(IGNORED.sub("", text)):
        if token[0] == "}":
            around = around[:-1]
        elif token[0].startswith("namespace"):
            around = [*around, token[1] or "(own)"]
        elif token[0] == "{":
            around = [*around, None]
        else:
            if None not in around and "(own)" not in around:
                names.append("::".join([*around, token[2]]))
            around = [*around, token[2]]
    return names


def main():
    source = pathlib.Path(sys.argv[1])
    homes = collections.defaultdict(set)
    for folder in FOLDERS:
        for file in sorted((source / folder).rglob("*")):
            if file.suffix in (".h", ".cpp"):
                for name in types_of(file.read_text()):
                    homes[name].add(file.relative_to(source).as_posix())
    wrong = [f"{name}: defined in {' and '.join(sorted(files))}" for name, files in homes.items() if len(files) > 1]
    example = "namespace a {\nstruct B {\n    struct C { int d[2]{}; };\n};\nnamespace {\nstruct E {};\n}\nvoid f() { struct G {}; }\n}"
    if types_of(example) != ["a::B", "a::B::C"]:
        wrong.append(f"self-test: {types_of(example)}")
    print("\n".join(wrong + [f"{len(homes)} types, {len(wrong)} wrong"]))
    return 1 if wrong or not homes else 0


if __name__ == "__main__":
    sys.exit(main())
