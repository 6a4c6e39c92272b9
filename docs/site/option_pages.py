"""The pages of options: what `--help all` prints, as headings, anchors and text.

docs/reference/make.sh writes the help between ```text and ```. Its form: a topic ends with a colon, an option begins
within the first eight columns, and its description stands from column 28 on.
"""

import html
import re

COLUMN = 28


def topics(text):
    """(topic or None, entries, lines of text) of the help; an entry is [names, description]."""
    found = [[None, [], []]]
    for line in text.split("\n"):
        if re.match(r"[A-Z][\w ]*:$", line):
            found.append([line[:-1], [], []])
        elif not line.startswith(" "):
            if found[-1][1] and line:  # after the options: what the help ends with
                found.append([None, [], []])
            found[-1][2].append(line)
        elif line[:COLUMN].strip() and re.match(r" {2,7}\S", line):
            names, description = line.strip(), ""
            gap = re.match(r"(.*\S) {2,}(\S.*)", line.strip())
            if line[COLUMN - 1:COLUMN] == " " and line[COLUMN:] and gap:
                names, description = line[:COLUMN].strip(), line[COLUMN:]
            found[-1][1].append([names, description])
        elif not found[-1][1]:
            raise SystemExit("site: options: the form of the help is not understood near '%s'" % line.strip())
        else:
            found[-1][1][-1][1] += " " + line.strip()
    return found


def anchor(names):
    """`-j, --threads N` is #--threads."""
    return next((m[0] for m in [re.search(r"--[\w-]+", names), re.search(r"-[\w]+", names)] if m), None)


def page(markdown):
    """A page of options with a heading for each; the page as it is if it holds no help."""
    block = re.search(r"^```text\n(.*?)\n```$", markdown, re.S | re.M)
    out, used = [], set()
    for topic, entries, text in topics(block[1]):
        if topic:
            out.append("## %s" % topic)
        lines = "\n".join(text).strip().split("\n")
        usage = [line for line in lines if line.startswith("Usage:")]
        out.append(html.escape(" ".join(line for line in lines if line not in usage)))
        out += ["```sh\n%s\n```" % line[len("Usage: "):] for line in usage]
        for names, description in entries:
            place = anchor(names)
            if place and place not in used:
                used.add(place)
                out.append("### `%s` {#%s .option data-toc-label=%s}" % (names, place, place))
            else:
                out.append("**`%s`**{.option}" % names)
            out.append("%s" % html.escape(description.strip(), quote=False).replace("*", "\\*").replace("_", "\\_"))
    return markdown[:block.start()] + "\n\n".join(filter(None, out)) + markdown[block.end():]
