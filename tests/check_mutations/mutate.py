"""Makes copies of sources in which chosen values have a switch: mutate.py TO_FOLDER LIST.json ROOT ROOM...

ROOT holds the folders ROOM..., e.g. tools/pbm-build and pbm_build. Each row of mutations.csv whose file lies in one of them
names a place in that file, a text that stands there once with the mutated expression between two @, and another expression.
The copy of ROOM/NAME is TO_FOLDER/ROOM/NAME; all sources of the rooms are copied, and headers that have mutations. In a copy
the expression `a` with the mutation `b` reads (pbm::is_mutated(N) ? (b) : (a)); a constant that is declared there is const
and no longer constexpr. LIST.json gets number, file, line, text, mutation, tests and reason of each row; numbers are those of
the rows of mutations.csv. Files whose copies stay the same are not written.
"""

import csv
import json
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent

def rows_of(rooms):
    with open(HERE / "mutations.csv", newline="", encoding="utf-8") as table:
        rows = [row | {"number": number} for number, row in enumerate(csv.DictReader(table), 1)]
    return [row for row in rows if row["file"].split("/")[0] in rooms]

def declared_variable(text):
    """The declaration of a constant that begins with `text`, as that of a variable."""
    return text.replace("static constexpr ", "static inline const ").replace("constexpr ", "const ")

def mutated(text, rows):
    places = []
    for row in rows:
        before, value, after = row["text"].split("@")
        found = [match.start() for match in re.finditer(re.escape(before + value + after), text)]
        if len(found) != 1:
            sys.exit(f"mutations.csv {row['number']}: {row['file']} has this text {len(found)} times: {row['text']}")
        places.append((found[0] + len(before), value, row))
        row["line"] = text.count("\n", 0, found[0]) + 1
    for at, value, row in sorted(places, key=lambda place: place[0], reverse=True):
        text = text[:at] + f"(pbm::is_mutated({row['number']}) ? ({row['mutant']}) : ({value}))" + text[at + len(value):]
    for row in rows:
        at = text.index(f"(pbm::is_mutated({row['number']})")
        begin = max(text.rfind(mark, 0, at) for mark in ";{}")
        text = text[:begin + 1] + declared_variable(text[begin + 1:at]) + text[at:]
    return text

def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")

def main(folder, listing, root, *rooms):
    rows = rows_of(rooms)
    by_file = {}
    for row in rows:
        by_file.setdefault(row["file"], []).append(row)
    files = {str(path.relative_to(root)) for room in rooms for path in Path(root, room).rglob("*.cpp")}
    for file in sorted(files | by_file.keys()):
        text = mutated(Path(root, file).read_text(encoding="utf-8"), by_file.get(file, []))
        if file in by_file:
            pragma = "#pragma once\n" if "#pragma once\n" in text else ""
            text = f'{pragma}#include "check_mutations/switches.h"\n#line 1\n' + text
        write(Path(folder, file), text)
    for row in rows:
        row["text"] = row["text"].replace("@", "")
    Path(listing).write_text(json.dumps(rows, indent=1), encoding="utf-8")

if __name__ == "__main__":
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
