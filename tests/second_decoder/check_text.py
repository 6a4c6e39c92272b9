"""Holds BVG.md against the second decoder: check_text.py [--write]

Every rule of a list is one that the decoder verifies, and the other way round; each has a mark; the marks are those of 8.3.
The normative tables 6.2.1 and 6.3.3 are those that the decoder computes, and so are the results of the examples. The
listings of appendices C and D and the test values of section 16 are those of their files and of XXH3 (--write puts them
there). No line is too long, and none starts a quotation or a list by accident.
"""

import re
import sys
from pathlib import Path

import xxhash

import listing
import worked_example
from header import MAGIC
from rasters import mean_of_four
from streams import unrank
from values import INTEGER_NORMALS, K, LINEAR, RADII, normal_index

HERE = Path(__file__).resolve().parent
SPEC = HERE / "../../format_spec/BVG.md"
VALID = HERE / "../../format_spec/vectors/valid"
DECODER = ("bvg", "header", "parameters", "levels", "streams", "bricks", "point_streams", "rasters",
           "fields")
LENGTHS = (0, 1, 4, 9, 17, 129, 241, 1025, 4096)        # one for each branch of XXH3
LONGEST = 120
RULE = r"\d+\.\d+(?:\.\d+)?"

def block(text, heading, number=0):
    """The numbered block of code below a heading."""
    return re.findall(r"^```\n(.*?)^```$", text[text.index(f"\n{heading}"):], re.M | re.S)[number]

def marks():
    """Of each rule its marks: R if readers verify it, V if validators alone do, RV if that depends on the section."""
    text = SPEC.read_text(encoding="utf-8")
    return {rule: marks.replace("*", "").replace(" ", "") for rule, marks in
            re.findall(rf"^- ({RULE}) ((?:\*\*[RV]\*\* )*)", text, re.M)}

def rules(text):
    """Whether the rules of the text are those that the decoder names, and each has a mark."""
    stated = re.findall(rf"^- ({RULE}) ", text, re.M)
    sources = [Path(HERE, f"{name}.py").read_text(encoding="utf-8") for name in DECODER]
    named = {rule for source in sources for rule in re.findall(rf'"({RULE})"', source)}
    faults = [f"rule {rule} is stated twice" for rule in sorted(set(stated)) if stated.count(rule) > 1]
    faults += [f"rule {rule} is not verified by the second decoder" for rule in sorted(set(stated) - named)]
    faults += [f"the second decoder names rule {rule}, no list of BVG.md does" for rule in sorted(named - set(stated))]
    return faults + [f"rule {rule} has no mark" for rule, mark in sorted(marks().items()) if mark not in ("R", "V", "RV")]

def marks_of_validators(text):
    """Whether 8.3 names the rules that are marked V."""
    paragraph = re.search(r"^8\.3 .*?\n\n", text, re.M | re.S)[0][4:]
    named, marked = set(re.findall(RULE, paragraph)), {rule for rule, mark in marks().items() if "V" in mark}
    return [f"8.3 and the mark of rule {rule} disagree" for rule in sorted(named ^ marked)]

def tables(text):
    def numbers(heading, number=0):
        return tuple(map(int, block(text, heading, number).split()))
    faults = [] if numbers("### 6.2") == K else ["the table of 6.2.1 is not that of the decoder"]
    return faults + ([] if numbers("### 6.3") == tuple(LINEAR) else ["the table of 6.3.3 is not rounded sRGB"])

def examples(text):
    """The results of the examples as the decoder computes them, each as the text should state it."""
    means = [tuple(mean_of_four(texels, 2, channels)) for texels, channels in (
        ((0, 1, 2, 255), 1), ((0, 0, 1, 1), 1), ((0, 0, 9, 0, 0, 9, 255, 1, 9, 255, 0, 9), 3))]
    small_sections = (4096, 48, 13 * 24, 8 * 32, 8 * 48, 800, 832, 784)
    front = 128 + 64 * 256 + sum(-(-size // 8) * 8 for size in small_sections)
    mask = unrank(bytes((0, 0, 0, 4, 0, 0)), (0x7D2,) * 6, b"\x3F")[3]
    sign = "positive" if normal_index((2 ** 60, 2 ** 60, -1)) < 4096 else "negative"
    results = {
        "3.10.14": "the values 0, 1, 2, 255 have the mean {}, and 0, 0, 1, 1 have the mean {}.".format(*means[0], *means[1]),
        "3.10.14, colours": f"(255, 0, 9) have the mean {means[2]}.",
        "5.9.5": f"mask {{1,5,0,3,2}} = 0x{mask:02X}",
        "6.1.3": f"(2^60, 2^60, -1) has an index with {sign} z.",
        "6.1.5": f"Index 0 has {INTEGER_NORMALS[0]}, index 0x155 has {INTEGER_NORMALS[0x155]}.",
        "6.2.1": f"Index 203 is {RADII[203]:,}, index 255 is 2^{RADII[255].bit_length() - 1}.",
        "8.4.1": f"The first {-(-front // 8192) * 8192:,} bytes hold header, table and all small sections",
        "13": f"would read {int.from_bytes(MAGIC[:4], 'little'):,} from the magic number"}
    flowing = " ".join(text.split())
    return [f"the example of {place} is not as the decoder has it: {result}" for place, result in results.items()
            if result not in flowing]

def hash_table():
    """The test values of section 16."""
    lines = ["bytes   XXH3-64, a number       XXH3-64, 8 bytes of a file   XXH3-128, 16 bytes of a file"]
    for length in LENGTHS:
        data = bytes(i % 256 for i in range(length))
        h64, h128 = xxhash.xxh3_64_intdigest(data), xxhash.xxh3_128_intdigest(data)
        lines.append(f"{length:5}   0x{h64:016X}      {h64.to_bytes(8, 'little').hex(' ').upper()}      "
                     f"{h128.to_bytes(16, 'little').hex(' ').upper()}")
    return "\n".join(lines)

def generated():
    """The blocks of code that are made from files: heading, number of the block below it, text."""
    yield "## 16.", 0, hash_table()
    yield "## Appendix C.", 0, listing.listing(VALID / "smallest.pbvg")
    for number, text in enumerate(worked_example.blocks(VALID / "worked-example.pbvg")):
        yield "## Appendix D.", number, text

def main(arguments):
    text, faults = SPEC.read_text(encoding="utf-8"), []
    for heading, number, right in generated():
        written = block(text, heading, number)
        if arguments == ["--write"]:
            text = text.replace(written, right + "\n")
        elif written != right + "\n":
            faults.append(f"block {number} of '{heading}' is not that of its file: run check_text.py --write")
    if arguments == ["--write"]:
        SPEC.write_text(text, encoding="utf-8")
    faults += rules(text) + marks_of_validators(text) + tables(text) + examples(text)
    prose = re.sub(r"^```\n.*?^```$", lambda code: "\n" * code[0].count("\n"), text, flags=re.M | re.S)
    for number, (line, outside) in enumerate(zip(text.splitlines(), prose.splitlines()), 1):
        if len(line) > LONGEST and not line.startswith("|"):
            faults.append(f"BVG.md:{number}: longer than {LONGEST} characters")
        if re.match(r" *[>+=*] ", outside):
            faults.append(f"BVG.md:{number}: starts a quotation or a list")
    print("\n".join(faults), end="\n" if faults else "")
    print(f"{len(re.findall(rf'^- {RULE} ', text, re.M))} rules, {len(faults)} faults")
    return 1 if faults else 0

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
