"""Sources without their checks: unchecked.py INSTRUMENT.py FOLDER SOURCE...

What instrument.py makes of them, less what is only gathered for a check. (Hashes that are compared with nothing the
compiler leaves out, since hash64 is a pure function.)
"""
import subprocess
import sys
from pathlib import Path

# What stands in the copies, and what takes its place.
GATHERED = {
    "chunk.cpp": [("const OutsideCone *outside = outside_cone();", "const OutsideCone *outside = nullptr;"),
                  ("check_cone(to_.points.normals, entry_.cone, scratch_.outside, offset_, rules_.wording)", "Status()")],
    "frame.cpp": [("= ZSTD_findFrameCompressedSize(stored.data(), stored.size());", "= 0;"),
                  ("= ZSTD_getFrameContentSize(stored.data(), stored.size());", "= 0;")],
    "sibling_layout.cpp": [("summary.zero |= equal_lanes(some, set(0)) != 0;", "")],
    "unfilter.cpp": [("strange |= escapes ^ equal_lanes(some, set(15));", ""),
                     ("valid &= escape[1] < 64;", "")],
}

def main(instrument, folder, *sources):
    subprocess.run([sys.executable, "-B", instrument, folder, f"{folder}/checks.json", "1", "--no-steps", *sources], check=True)
    for name, statements in GATHERED.items():
        path = next(Path(folder).rglob(name))
        text = path.read_text(encoding="utf-8")
        for statement, substitute in statements:
            if text.count(statement) != 1:
                sys.exit(f"{name}: '{statement}' is there {text.count(statement)} times, not once")
            text = text.replace(statement, substitute)
        path.write_text(text, encoding="utf-8")

if __name__ == "__main__":
    main(*sys.argv[1:])
