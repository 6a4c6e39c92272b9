"""Sources without their checks: unchecked.py INSTRUMENT.py FOLDER SOURCE...

What instrument.py makes of them, less what is only gathered for a check: which normals occur in a chunk.
"""
import subprocess
import sys
from pathlib import Path

GATHERED = {
    "chunk.cpp": ["scratch_.occurs.fill(0);"],
    "stream_rules.cpp": ["occurs[normal & kUsedBits] = 1;"],
    "unfilter.cpp": ["occurs[first] = 1;", "occurs[second] = 1;"],
}

def main(instrument, folder, *sources):
    subprocess.run([sys.executable, "-B", instrument, folder, f"{folder}/checks.json", "1", "--no-steps", *sources], check=True)
    for name, statements in GATHERED.items():
        path = Path(folder, name)
        text = path.read_text(encoding="utf-8")
        for statement in statements:
            if text.count(statement) != 1:
                sys.exit(f"{name}: '{statement}' is there {text.count(statement)} times, not once")
            text = text.replace(statement, "")
        path.write_text(text, encoding="utf-8")

if __name__ == "__main__":
    main(*sys.argv[1:])
