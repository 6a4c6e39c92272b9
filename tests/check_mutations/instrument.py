"""Makes copies of sources in which every check has a switch: instrument.py TO_FOLDER LIST.json FIRST_NUMBER [--no-steps] SOURCE...

A check is what makes code refuse its input: the condition of an `if` that guards an error, a `return false` or a step of
a chain of such; each operand of its `||` is one of its own. So is each operand of the `&&` of a condition that must hold:
a `return a && b;`, an `if (a && b) return {};` or the like before an error, or a `const bool name = a && b;` that is
asked for as `!name`.

The copy of ROOM/NAME.cpp is TO_FOLDER/ROOM/NAME.cpp. In it such a condition `c` reads ((c) && pbm::check_kept(N)): with the check N removed it never holds; one that must
hold reads ((c) || !pbm::check_kept(N)). LIST.json gets number, file, line and text of each check. With --no-steps only what
refuses has a switch: no step of a chain that ends with its first error, no `return a && b;`, which may look something up.
"""

import json
import re
import sys
from pathlib import Path

# What the guarded statement starts with if it refuses something.
REFUSES = re.compile(r"""\s*\{?\s*(?:
    return\s+(?:\w+::)*(?:Error\b|bad\w*\(|broken\w*\(|refuse\w*\(|fault\w*\(|faults\b|impossible\w*\(|false\b|status\b)
  | return\s+(?:at_section|of_tile|wrong_\w+|explain_\w+)\(
  | return\s+[^;]*\.error\(\)
  | return\s+(?:\w+\.)?\w+(?:->|\.)error
  | (?:\w+\.)?fault\w*\(
  | faults\.add | failures\[ | refused\[i\]\s*=
)""", re.VERBOSE)
# A step of a chain that ends with its first error.
STEP = re.compile(r"\s*\{?\s*status\s*=")
# What refuses further on in a block.
REFUSES_LATER = re.compile(r"[;{]\s*(?:fault\(|Error\s+\w+\s*=|return\s+(?:\w+::)*(?:Error\b|bad\w*\(|broken\w*\(|fault\w*\())")
# What follows a condition that must hold.
WELL_OR_REFUSED = re.compile(r"""\s*(?:
    return\s*\{\};\s*(?:const\s[^;]*;\s*)?(?:return|Status\s+status\s*=)\s+(?:\w+::)*(?:broken|of_tile|describe_)\w*\(
  | (?:continue|return);[^{}]{0,500}?\b(?:fault\(|faults\.add\()
)""", re.VERBOSE)
LONGEST_BLOCK = 500                                     # characters: what is longer does more than refuse
OPENING, CLOSING = "([{", ")]}"

def blank(text):
    """The text with comments and literals blanked, of the same length."""
    def spaces(match):
        return re.sub(r"[^\n]", " ", match.group())
    pattern = r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|(?<![0-9a-zA-Z])\'(?:\\.|[^\'\\\n])+\''
    return re.sub(pattern, spaces, text, flags=re.DOTALL)

def closing(code, at):
    """Place of the bracket that closes the one at `at`."""
    depth = 0
    for i in range(at, len(code)):
        depth += code[i] in OPENING
        depth -= code[i] in CLOSING
        if depth == 0:
            return i
    raise ValueError("a bracket without end")

def split(code, begin, end, separators):
    """Places of those separators in code[begin:end] that stand outside brackets."""
    depth, found, i = 0, [], begin
    while i < end:
        depth += code[i] in OPENING
        depth -= code[i] in CLOSING
        if depth == 0:
            for separator in separators:
                if code.startswith(separator, i):
                    found.append((i, separator))
                    i += len(separator) - 1
                    break
        i += 1
    return found

def ranges(code, begin, end, separator):
    places = [place for place, _ in split(code, begin, end, [separator])]
    starts = [begin, *(place + len(separator) for place in places)]
    return list(zip(starts, [*places, end]))

class Source:
    def __init__(self, path, first, steps):
        self.steps = steps
        self.text = path.read_text(encoding="utf-8")
        self.code = blank(self.text)
        self.name, self.number = path.name, first
        self.checks, self.insertions, self.taken = [], [], set()

    def switch(self, begin, end, form):
        while self.code[begin].isspace():
            begin += 1
        while self.code[end - 1].isspace():
            end -= 1
        if (begin, end) in self.taken:
            return
        self.taken.add((begin, end))
        kept = f"pbm::check_kept({self.number})"
        before, after = {"fails": ("((", f") && {kept})"), "holds": ("((", f") || !{kept})")}[form]
        if "hash64(" in self.code[begin:end]:           # nobody needs a hash that is compared with nothing
            before, after = f"({kept} && (", "))"
        self.insertions += [(begin, 0, before), (end, 1, after)]
        line = self.text.count("\n", 0, begin) + 1
        self.checks.append({"number": self.number, "file": self.name, "line": line,
                            "text": " ".join(self.text[begin:end].split())})
        self.number += 1

    def switch_condition(self, begin, end, form):
        """Each operand of a condition that refuses (form fails, ||) or that must hold (form holds, &&)."""
        marks = split(self.code, begin, end, ["?", "::", ":"])
        marks = [(place, mark) for place, mark in marks if mark != "::"]
        if marks:                                       # conditions of ?: choose, what they choose checks
            edges = [begin - 1, *(place for place, _ in marks), end]
            for i, (start, stop) in enumerate(zip(edges, edges[1:])):
                if i == len(marks) or marks[i][1] == ":":
                    self.switch_condition(start + 1, stop, form)
            return
        for start, stop in ranges(self.code, begin, end, "||" if form == "fails" else "&&"):
            self.switch(start, stop, form)

    def refuses(self, at):
        """Whether the statement at that place does nothing but refuse."""
        if REFUSES.match(self.text[at:at + 400]) or (self.steps and STEP.match(self.text[at:at + 400])):
            return True
        at += len(self.code[at:]) - len(self.code[at:].lstrip())
        if self.code[at] != "{":
            return False
        block = self.code[at:closing(self.code, at) + 1]
        return len(block) < LONGEST_BLOCK and REFUSES_LATER.search(block) is not None and not re.search(r"\bfor\b", block)

    def find(self):
        refusing = ""                                   # conditions, one after the other
        for match in re.finditer(r"\bif\s*\(", self.code):
            opened = match.end() - 1
            closed = closing(self.code, opened)
            if not self.refuses(closed + 1):
                continue
            init = split(self.code, opened + 1, closed, [";"])
            begin = init[-1][0] + 1 if init else opened + 1
            self.switch_condition(begin, closed, "fails")
            refusing += self.code[begin:closed] + ";"
        for match in re.finditer(r"\breturn\s", self.code if self.steps else ""):
            end = match.end()
            stop = split(self.code, end, len(self.code), [";"])
            if stop and len(ranges(self.code, end, stop[0][0], "&&")) > 1 and "=" not in self.code[end:end + 1]:
                self.switch_condition(end, stop[0][0], "holds")
        for match in re.finditer(r"\bif\s*\(", self.code):  # all is well, or else what follows refuses
            closed = closing(self.code, match.end() - 1)
            if WELL_OR_REFUSED.match(self.code, closed + 1):
                self.switch_condition(match.end(), closed, "holds")
        for match in re.finditer(r"\breturn\s([^;?]*)\?[^;]*:\s*Status\{\};", self.code): # refuse or go on
            self.switch_condition(match.start(1), match.end(1), "fails")
        for match in re.finditer(r"\bconst bool (\w+)\s*=", self.code):
            if re.search(rf"!{match.group(1)}\b", refusing):
                stop = split(self.code, match.end(), len(self.code), [";"])[0][0]
                self.switch_condition(match.end(), stop, "holds")

    def instrumented(self):
        out, at = [], 0
        for place, _, text in sorted(self.insertions, key=lambda item: (item[0], -item[1])):
            out += [self.text[at:place], text]
            at = place
        return '#include "check_mutations/switches.h"\n#line 1\n' + "".join(out) + self.text[at:]

def main(folder, listing, first, *sources):
    steps = "--no-steps" not in sources                 # whether a chain's steps may be left out, as checks
    sources = [source for source in sources if source != "--no-steps"]
    number, checks = int(first), []
    for path in map(Path, sources):
        source = Source(path, number, steps)
        source.find()
        number = source.number
        checks += source.checks
        target = Path(folder, path.parent.name, path.name)
        target.parent.mkdir(parents=True, exist_ok=True)
        text = source.instrumented()
        if not target.exists() or target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")
    Path(listing).write_text(json.dumps(checks, indent=1), encoding="utf-8")

if __name__ == "__main__":
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
