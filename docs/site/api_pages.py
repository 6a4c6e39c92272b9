"""The API reference: public headers as pages of Markdown.

A header is its own manual here: a comment in front, then declarations, each with its contract above it. A page shows
the comment as text and each declaration under a heading of its own, so that search and links find it. Declarations are
shown as they stand, without bodies of functions, private members and long tables of values.
"""

import os
import re

ROOTS = ["", "format_spec/", "runtime/", "tools/"]  # folders in which `#include "..."` finds our headers
MOST_LINES = 12  # of an initialiser that is shown
FORWARD = re.compile(r"(struct|class|enum class) \w+( : [\w:]+)?;")  # declares what another header describes


class Header:
    """A header in the tree and its place on the site: `page`, with the anchor of a declaration after it."""

    def __init__(self, path, page):
        self.path, self.page = path, page
        with open(path, encoding="utf-8") as file:
            lines = file.read().split("\n")
        self.includes = [m[1] for m in (re.match(r'#include "(.*)"', line) for line in lines) if m]
        self.about, self.blocks = parse(lines)


def find(include, beside):
    """The path of an included header of ours, or None."""
    places = [root + include for root in ROOTS] + [os.path.join(os.path.dirname(beside), include)]
    return next((os.path.normpath(place) for place in places if os.path.isfile(place)), None)


def gather(doors):
    """All headers that the doors include, by path. A door has a page, other headers share that of their folder."""
    headers, waiting = {}, list(doors)
    while waiting:
        path = waiting.pop(0)
        if path in headers:
            continue
        folder = os.path.dirname(path)
        headers[path] = Header(path, path + ".md" if path in doors else folder + "/headers.md")
        waiting += filter(None, (find(include, path) for include in headers[path].includes))
    return headers


def code_of(line):
    """A line without comment, strings and characters: what counts braces."""
    return re.sub(r'"(\\.|[^"\\])*"|\'(\\.|[^\'\\])+\'|//.*|/\*.*?\*/', "", line)


def comment_lines(lines, at):
    """The text of the comment that starts at line `at`, and the line after it; (None, at) if there is none."""
    if lines[at].lstrip().startswith("//"):
        text = []
        while at < len(lines) and lines[at].lstrip().startswith("//"):
            text.append(re.sub(r"^\s*//[/!<]* ?", "", lines[at]))
            at += 1
        return text, at
    if lines[at].lstrip().startswith("/*"):
        text = []
        while at < len(lines):
            line, ended = lines[at], "*/" in lines[at]
            text.append(re.sub(r"^\s*(/\*+[!<]?|\*(?!/)) ?|\s*\*/.*$", "", line).rstrip() if "/*" not in line else
                        re.sub(r"^\s*/\*+[!<]? ?|\s*\*/.*$", "", line))
            at += 1
            if ended:
                break
        return text, at
    return None, at


def parse(lines):
    """The comment on top, and the blocks of the rest: (comment, declaration), both lists of lines."""
    at, about = 0, []
    while at < len(lines) and not lines[at].strip():
        at += 1
    first, at = comment_lines(lines, at)
    about = first or []
    blocks, comment = [], []
    while at < len(lines):
        line = lines[at]
        if line == "#ifdef __cplusplus":  # what C++ sees of a C header says the same in another form
            while lines[at] not in ("#else", "#endif"):
                at += 1
        text, after = comment_lines(lines, at)
        if text is not None:
            comment, at = text, after
            continue
        plain = code_of(line).strip()
        opens = re.match(r'(inline )?namespace [\w:]*\s*{$|extern "C"\s*{?$|extern\s*{$', plain)
        if not plain or plain.startswith("#") or plain in ("}", "};") or opens:
            if plain.startswith("#"):
                while lines[at].endswith("\\"):
                    at += 1
                if plain.startswith("#define") and comment:  # a constant or macro that is documented
                    blocks.append((comment, [line]))
                    comment = []
            elif comment and not plain:
                blocks.append((comment, []))  # about what follows as a whole
                comment = []
            at += 1
            continue
        declaration = []
        while at < len(lines):  # to the next empty line or comment outside of braces
            depth = 0
            while at < len(lines):
                declaration.append(lines[at])
                plain = code_of(lines[at])
                depth += sum(map(plain.count, "({[")) - sum(map(plain.count, ")}]"))
                at += 1
                if depth <= 0 and plain.rstrip().endswith((";", "}")):
                    break
            if at < len(lines) and (not lines[at].strip() or lines[at].lstrip().startswith(("//", "/*", "#", "}"))):
                break
        declaration = [line for line in declaration if not FORWARD.match(line)]
        if declaration and not declaration[0].startswith("static_assert"):
            blocks.append((comment, shorten(declaration)))
        comment = []
    return about, blocks


def without_bodies(text, depth_of_bodies):
    """Without bodies and initialisers of functions that stand `depth_of_bodies` braces deep."""
    out, at, depth = "", 0, 0
    for token in re.finditer(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])+\'|[{}]|.|\n', text, re.S):
        if token.start() < at:
            continue
        if token[0] == "{" and depth == depth_of_bodies:
            line = re.search(r"\)( const| noexcept| override| &&?)*(\s*: \w+[({][^;]*)?\s*$", out)
            if line and "=" not in code_of(out[:line.start()].split("\n")[-1].split("(")[0]):
                at = end_of_braces(text, token.start())
                out = out[:line.start()] + line[0].split(" : ")[0].split("\n")[0].rstrip() + ";"
                continue
        depth += {"{": 1, "}": -1}.get(token[0], 0)
        out += token[0]
    return out


def end_of_braces(text, at):
    depth = 0
    for token in re.finditer(r'//[^\n]*|"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])+\'|[{}]', text[at:]):
        depth += {"{": 1, "}": -1}.get(token[0], 0)
        if depth == 0:
            return at + token.end()
    return len(text)


def shorten(declaration):
    """What a caller may use: no bodies of functions, no private members, no long tables of values."""
    text = re.sub(r"\[\[gnu::\w+\]\] ", "", "\n".join(declaration))
    if re.match(r"(template\s*<.*?>\s*)?(typedef )?(struct|class|enum|union)\b[^(;]*{", text, re.S):
        text = re.sub(r"\n+ +private:\n.*?(?=\n};|\n +public:)", "", text, flags=re.S)
        text = without_bodies(text, 1)
    text = without_bodies(text, 0)
    lines = text.split("\n")
    if len(lines) > MOST_LINES and "=" in lines[0] and lines[0].endswith("{"):
        lines = ["%s /* %d lines */ %s" % (lines[0], len(lines) - 2, lines[-1])]
    return lines


def names(declaration):
    """What a block declares: names in their order, none twice."""
    found, depth = [], 0
    for line in declaration:
        plain = code_of(line)
        if depth == 0:
            plain = re.sub(r"^\s*(template\s*<.*>\s*)?((typedef|extern|static|inline|constexpr|\[\[\w+\]\]|PBM_\w+) )*",
                           "", plain)
            match = (re.match(r"#define (\w+)", plain) or re.match(r"[\w ]+\(\*(\w+)\)\(", plain)
                     or re.match(r"(?:struct|class|enum class|enum|union) (\w+)(?=[\s:;{])(?![^;{]*\()", plain)
                     or re.match(r"using (\w+) =", plain) or re.match(r"[^=(]*?(operator\S+?|~?\w+)\s*\(", plain)
                     or re.match(r"[^={]*?(\w+)(\[[^\]]*\])?\s*(=|{|;)", plain))
            begins = not plain.startswith((" ", "requires", ")", "}"))
            if match and begins and match[1] not in found + ["static_assert", "enum"]:
                found.append(match[1])
        depth += sum(map(plain.count, "({[")) - sum(map(plain.count, ")}]"))
    return found


def prose(comment):
    """A comment as Markdown: paragraphs flow, what is indented or in columns keeps its form."""
    parts, part = [], []
    for line in comment + [""]:
        if line.strip():
            part.append(line)
        elif part:
            parts.append(part)
            part = []
    out, program = [], []
    for number, part in enumerate(parts):
        if all(line.startswith("  ") for line in part) and (program or re.match(r"  +(#include|\w.*[;{]$)", part[0])):
            program += [""] * bool(program) + part
            if number + 1 < len(parts) and parts[number + 1][0].startswith("  "):
                continue
            out.append("```cpp\n%s\n```" % unindented(program))
            program = []
        elif any(re.search(r"^ |\S   ?\S", line) for line in part):
            title = part[0] if not re.search(r"^ |\S   ?\S", part[0]) else None
            if title:
                out.append(escaped(title))
            out.append("```text\n%s\n```" % unindented(part[bool(title):]))
        else:
            out.append(escaped(" ".join(part)))
    return "\n\n".join(out)


def unindented(lines):
    least = min(len(line) - len(line.lstrip()) for line in lines if line.strip())
    return "\n".join(line[least:] for line in lines)


def escaped(text):
    """Text of a comment for Markdown: code in backticks stays, nothing else is markup."""
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(part if part.startswith("`") else re.sub(r"([\\*_<\[\]{}#])", r"\\\1", part).replace("\\<", "&lt;")
                   for part in parts)


def declarations(header, level, taken):
    """The blocks of a header, and the names they declare besides those that are `taken` on their page."""
    out, declared = [], []
    for comment, declaration in header.blocks:
        new = [name for name in names(declaration) if name not in taken + declared]
        if new:
            shown = [name for name in new if not name.startswith("operator")] or new
            title = ", ".join("`%s`" % name for name in shown[:3]) + (", ..." if len(shown) > 3 else "")
            out.append("%s %s {#%s}" % ("#" * level, title, shown[0]))
            anchors = "".join('<a id="%s"></a>' % name for name in shown[1:])
            if anchors:
                out.append("<div>%s</div>" % anchors)
            declared += new
        if comment:
            out.append(prose(comment))
        if declaration:
            language = "c" if header.path.startswith("bindings/c/") else "cpp"
            out.append("```%s\n%s\n```" % (language, re.sub(r"^PBM_API ", "", unindented(declaration), flags=re.M)))
    return out, [name for name in declared if re.fullmatch(r"\w+", name)]


def pages(doors):
    """({page: Markdown}, {name: page and anchor}, {header: page}) of the doors and all that they include."""
    headers = gather(doors)

    def order(path):
        return (doors.index(path) if path in doors else len(doors), path)

    written, where, places, taken = {}, {}, {}, {}
    for path, header in sorted(headers.items(), key=lambda item: order(item[0])):
        folder = re.sub(r"^(format_spec|runtime|tools)/", "", os.path.dirname(path))
        door = path in doors
        name = os.path.basename(path)
        anchor = "" if door else "#" + name
        out, declared = declarations(header, 2 if door else 3, taken.get(header.page, []))
        taken[header.page] = taken.get(header.page, []) + declared
        if door:
            out = ["# pbm/" + name, prose(header.about)] + out
            ours = [find(include, path) for include in header.includes]
            rows = ["- [%s](%s)" % (include, os.path.relpath(headers[found].page, os.path.dirname(path)) +
                                    "#" + os.path.basename(found))
                    for include, found in zip(header.includes, ours) if found]
            if rows:
                out += ["## Declarations", "The header includes these; their pages describe each declaration:",
                        "\n".join(rows)]
        else:
            if header.page not in written:
                written[header.page] = "# %s/" % folder
            out = ["## %s {#%s}" % (name, name), prose(header.about)] + out
        written[header.page] = "\n\n".join(filter(None, [written.get(header.page), *out])) + "\n"
        places[path] = header.page + anchor
        for declaration in declared:
            where.setdefault(declaration, "%s#%s" % (header.page, declaration))
    return written, where, places
