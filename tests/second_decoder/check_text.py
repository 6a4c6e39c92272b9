"""Holds BVG.md against the second decoder: check_text.py [--write]

Every rule of a list is one that the decoder proves, and the other way round; the normative tables 6.2.1 and 6.3.3 are those
that the decoder computes; the listing of section 14 is that of its file (--write puts it there); no line is too long.
"""

import re
import sys
from pathlib import Path

import listing
from values import K, LINEAR

HERE = Path(__file__).resolve().parent
SPEC = HERE / "../../format_spec/BVG.md"
EXAMPLE = HERE / "../../format_spec/vectors/valid/smallest.pbvg"
DECODER = ("bvg", "header", "parameters", "levels", "streams", "bricks", "rasters")
LONGEST = 130
RULE = r"\d+\.\d+(?:\.\d+)?"

def block(text, heading, number=0):
    """The numbered block of code below a heading."""
    return re.findall(r"^```\n(.*?)^```$", text[text.index(f"\n{heading}"):], re.M | re.S)[number]

def rules(text):
    """Whether the rules of the text are those that the decoder names."""
    stated = re.findall(rf"^- ({RULE}) ", text, re.M)
    sources = [Path(HERE, f"{name}.py").read_text(encoding="utf-8") for name in DECODER]
    named = {rule for source in sources for rule in re.findall(rf'"({RULE})"', source)}
    faults = [f"rule {rule} is stated twice" for rule in sorted(set(stated)) if stated.count(rule) > 1]
    faults += [f"rule {rule} is not proven by the second decoder" for rule in sorted(set(stated) - named)]
    return faults + [f"the second decoder names rule {rule}, no list of BVG.md does" for rule in sorted(named - set(stated))]

def tables(text):
    def numbers(heading, number=0):
        return tuple(map(int, block(text, heading, number).split()))
    faults = [] if numbers("### 6.2") == K else ["the table of 6.2.1 is not that of the decoder"]
    return faults + ([] if numbers("### 6.3") == tuple(LINEAR) else ["the table of 6.3.3 is not rounded sRGB"])

def main(arguments):
    text = SPEC.read_text(encoding="utf-8")
    written, right = block(text, "## 14."), listing.listing(EXAMPLE) + "\n"
    if arguments == ["--write"]:
        text = text.replace(written, right)
        SPEC.write_text(text, encoding="utf-8")
        written = right
    faults = rules(text) + tables(text)
    faults += [] if written == right else ["the listing of section 14 is not that of its file: run check_text.py --write"]
    faults += [f"BVG.md:{number}: longer than {LONGEST} characters" for number, line in enumerate(text.splitlines(), 1)
               if len(line) > LONGEST and not line.startswith("|")]
    print("\n".join(faults), end="\n" if faults else "")
    print(f"{len(re.findall(rf'^- {RULE} ', text, re.M))} rules, {len(faults)} faults")
    return 1 if faults else 0

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
