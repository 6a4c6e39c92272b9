"""Hooks of mkdocs: what the HTML of a page gets beyond its Markdown.

Each numbered paragraph of BVG.md is an anchor (BVG.html#3.2.14), and each mention of one a link. So are names of types
and headers in the API reference, options, and codes of the validator. Pictures have their sizes and are loaded when
they are near.
"""

import os
import re

SPECIFICATION = "format_spec/BVG.md"
CODES = "docs/reference/validator-codes.md"
OTHER_PROGRAMS = ("docs/explanation/", "docs/history/", "tests/", "bench/")  # pages that name options of these
VIEWER = "docs/reference/pbm-view.md"
PARAGRAPH = r"\d+\.\d+(?:\.\d+)*[a-z]?"
NUMBER = r"(?:\d+|[A-D])(?:\.\d+)*[a-z]?"  # a chapter or a paragraph
pages = None  # site_pages.Pages, set by make_site.py
numbers = set()  # anchors of BVG.md
words = {}  # option or code of the validator: where the site describes it
found = []  # (place, title, text) that search finds besides headings


def find_numbers(markdown):
    """The numbers of chapters, headings, paragraphs and rules of BVG.md."""
    starts = re.findall(r"(?:\n\n|\n- )(%s) " % PARAGRAPH, markdown)
    headings = re.findall(r"^#+ (?:Appendix )?(%s)\.? " % NUMBER, markdown, re.M)
    numbers.update(starts + headings)


def outside_tags(html, change, kept="a|pre|code|h1"):
    """Applies `change` to the texts of `html` outside of the elements `kept`."""
    out, depth = [], 0
    for part in re.split(r"(<[^>]*>)", html):
        if re.match(r"<(%s)\b" % kept, part):
            depth += 1
        elif re.match(r"</(%s)>" % kept, part):
            depth -= 1
        out.append(part if depth or part.startswith("<") else change(part))
    return "".join(out)


def plain(html):
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", "", html)).strip()


def rule_link(number, target):
    return '<a class="rule" href="%s#%s">%s</a>' % (target, number, number) if number in numbers else number


def specification(html):
    """Anchors of BVG.md, and links between its paragraphs."""
    html = re.sub(r"(<li>\s*<p>|<li>|<p>)(%s)(?= )" % PARAGRAPH, lambda m: m[0] if m[2] not in numbers else
                  '%s<a class="rule-number" id="%s" href="#%s">%s</a>' % (m[1], m[2], m[2], m[2]), html)
    for number, text in re.findall(r'<a class="rule-number" id="([^"]*)".*?</a>(.*?)</(?:li|p)>', html, re.S):
        found.append((SPECIFICATION.replace(".md", ".html#") + number, number, plain(text)))
    html = re.sub(r'(<h[2-4] id="[^"]*">)((?:Appendix )?)(%s)(?=\.? )' % NUMBER,
                  lambda m: '%s<a id="%s"></a>%s%s' % (m[1], m[3], m[2], m[3]), html)

    def link(text):
        text = re.sub(r"(?<![\w.^-])(?<!ersion )(?<!ersions )%s(?![\w%%])" % PARAGRAPH, lambda m:
                      rule_link(m[0], ""), text)
        return re.sub(r"((?:[Cc]hapters?|[Aa]ppendix) )(%s)(?:( and | to )(%s))?(?![\w.]\w)" % (NUMBER, NUMBER),
                      lambda m: m[1] + rule_link(m[2], "") + (m[3] + rule_link(m[4], "") if m[3] else ""), text)

    html = outside_tags(html, link, "a|code|h[1-6]|pre")
    chapters, after = html.split("</table>", 1)
    html = re.sub(r"(?<=<td>)(\d+|[A-D])(?=</td>)", lambda m: rule_link(m[1], ""), chapters) + "</table>" + after
    start = html.index('id="how-to-decode-a-packed-file"')  # its right column names paragraphs
    start = html.index("<pre", start)
    end = html.index("</pre>", start)
    steps = re.sub(r"(?<= )(%s)(?=[ ,;)\n<])" % PARAGRAPH, lambda m: rule_link(m[1], ""), html[start:end])
    return html[:start] + steps + html[end:]


def mentions(html, target):
    """Links to the paragraphs of BVG.md that other pages name."""
    return re.sub(r"(BVG\.md(?:</a>)?,? (?:paragraph |paragraphs |chapter |section )?)(%s)(?![\w-])" % NUMBER,
                  lambda m: m[1] + rule_link(m[2], target), html)


def api(html, page):
    """Links from names of types, constants and headers to where they are declared."""
    folder = os.path.dirname(page.file.src_path)

    def to(place):
        place, _, anchor = place.partition("#")
        return os.path.relpath(re.sub(r"\.md$", ".html", place), folder or ".") + ("#" + anchor if anchor else "")

    def names(part):  # of one heading, which they do not link to
        own = re.match(r'<h\d id="([^"]*)"', part)
        return re.sub(r'(<span class="n[cf]?">)([A-Z]\w+|k[A-Z]\w+|pbm_\w+)(?=</span>)', lambda m: m[0] if (
            m[2] not in pages.api or own and own[1] == m[2]) else '%s<a href="%s">%s</a>' % (
                m[1], to(pages.api[m[2]]), m[2]), part)

    html = "".join(map(names, re.split(r"(?=<h[23] )", html)))
    known = {re.sub(r"^(format_spec|runtime)/", "", path): place for path, place in pages.places.items()}
    known.update({re.sub(r"[^/]*$", "", path): place.partition("#")[0] for path, place in list(known.items())})

    def header(text):
        return re.sub(r"(?<![\w/])[a-z]\w*/(?:[\w-]+/)*(?:[\w-]+\.h)?", lambda m:
                      '<a href="%s">%s</a>' % (to(known[m[0]]), m[0]) if m[0] in known else m[0], text)

    html = outside_tags(html, header, "a|h[1-6]")
    target = os.path.relpath(SPECIFICATION.replace(".md", ".html"), folder)
    return outside_tags(html, lambda text: re.sub(r"(?<=\()%s(?=\))" % PARAGRAPH, lambda m:
                                                  rule_link(m[0], target), text), "a|h[1-6]")


def find_words(options, codes):
    """Options that one program has, pbm-view's aside, which has those of pbm-render too; codes of the validator."""
    owners = {}
    for page in options:
        with open(page, encoding="utf-8") as file:
            for option in set(re.findall(r"^ {2,7}(?:-\w, )?(--[a-z][\w-]+)", file.read(), re.M)):
                owners.setdefault(option, []).append(page)
    for option, pages_ in owners.items():
        rest = [page for page in pages_ if page != VIEWER or len(pages_) == 1]
        if len(rest) == 1:
            words[option] = rest[0].replace(".md", ".html#") + option
    with open(codes, encoding="utf-8") as file:
        for code in re.findall(r"^\| `([a-z_]+\.[a-z_]+)` \|", file.read(), re.M):
            words[code] = codes.replace(".md", ".html#") + code


def codes_table(html):
    """Each row of the validator's codes is an anchor, and search finds it."""
    for code, rest in re.findall(r"<tr>\s*<td><code>([a-z_.]+)</code></td>(.*?)</tr>", html, re.S):
        found.append((words[code], code, plain(rest)))
    html = re.sub(r"<td>(%s(?:, %s)*)</td>" % (PARAGRAPH, PARAGRAPH), lambda m: "<td>%s</td>" % ", ".join(
        rule_link(number, "../../format_spec/BVG.html") for number in m[1].split(", ")), html)
    return re.sub(r"<td><code>([a-z_]+\.[a-z_]+)</code>", r'<td><code id="\1">\1</code>', html)


def word_links(html, source):
    """Links from options and codes to where they are described."""
    here = os.path.dirname(source)

    def link(match):
        place = words.get(match[1].split()[0].split("=")[0])
        if place is None or place.startswith(source.replace(".md", ".html#")):
            return match[0]
        return '<a class="word" href="%s">%s</a>' % (os.path.relpath(place, here or "."), match[0])

    parts = re.split(r"(<a\b.*?</a>|<pre.*?</pre>|<h\d.*?</h\d>)", html, flags=re.S)
    return "".join(part if number % 2 else re.sub(r"<code>([^<\s][^<]*)</code>", link, part)
                   for number, part in enumerate(parts))


def on_page_content(html, page, config, files):
    source = page.file.src_path
    folder = os.path.dirname(source)
    if source == "README.md":
        page.meta.setdefault("hide", []).append("navigation")
    if source == SPECIFICATION:
        html = specification(html)
    else:
        html = mentions(html, os.path.relpath(SPECIFICATION.replace(".md", ".html"), folder or "."))
    if source == CODES:
        html = codes_table(html)
    if not source.startswith(OTHER_PROGRAMS):
        html = word_links(html, source)
    if source in pages.api_names:
        html = api(html, page)
    if source.endswith("ERRATA.md"):
        html = re.sub(r"(?<= )(\d+\.\d+\.\d+[a-z]?)(?=[ ,;)\n<])", lambda m: rule_link(m[1], "BVG.html"), html)

    def picture(match):
        path = os.path.normpath(os.path.join(folder, match[1]))
        size = ' width="%d" height="%d"' % pages.pictures[path] if path in pages.pictures else ""
        return '<a class="picture" href="%s"><img%s src="%s"%s loading="lazy"></a>' % (
            match[1], size, match[1], re.search(r' alt="[^"]*"', match[0])[0])

    html = re.sub(r'<img [^>]*src="([^"]*)"[^>]*>', picture, html)
    if "<h2" not in html:
        page.meta.setdefault("hide", []).append("toc")
    html = re.sub(r"<code>(?=[^<\n]{1,28}</code>)", '<code class="short">', html)
    html = re.sub(r"<table>.*?</table>", lambda m: '<div class="table">%s</div>' % m[0], html, flags=re.S)
    return html
