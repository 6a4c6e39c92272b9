"""Gathers the pages of the site: the tree's own Markdown, headers, and the sources that pages link to.

The site has the folders of the tree, so that links between pages are right in both places. A link to a source, which a
reader of the site may not have, leads to a page that shows it.
"""

import os
import pathlib
import re

from PIL import Image

import api_pages
import option_pages
import python_pages

DOORS = ["format_spec/pbm/format.h", "runtime/pbm/render.h", "runtime/pbm/bake.h", "tools/pbm/scan.h",
         "bindings/c/pbm.h"]
INDEX = "docs/README.md"  # whose tables are the navigation
LINK = re.compile(r"(!?\[(?:[^\[\]]|\[[^\[\]]*\])*\])\(([^()\s]+)\)")
LANGUAGES = {".h": "cpp", ".cpp": "cpp", ".hpp": "cpp", ".c": "c", ".py": "python", ".sh": "sh", ".json": "json",
             ".toml": "toml", ".cmake": "cmake", ".txt": "text", ".yml": "yaml", ".yaml": "yaml", ".bzl": "python"}
MOST_LINES = 2000  # of a folder whose files are shown in full
PICTURE_WIDTH = 1600


def with_links(markdown, change):
    """Markdown in which `change` says where each link and picture leads; blocks of code stay as they are."""
    parts = re.split(r"(^ *```.*?^ *```$)", markdown, flags=re.S | re.M)
    return "".join(part if number % 2 else LINK.sub(lambda link: "%s(%s)" % (link[1], change(link[2])), part)
                   for number, part in enumerate(parts))


class Pages:
    """Writes pages into the folder `to`. `written` holds their names; `api` leads from names that headers declare to
    their places, `places` from headers."""

    def __init__(self, to):
        self.to, self.written, self.pictures, self.options = pathlib.Path(to), set(), {}, []
        pages, self.api, self.places = api_pages.pages([door for door in DOORS if os.path.isfile(door)])
        for name, text in pages.items():
            self.write(name, text)
        self.api_names = list(pages)
        self.write(python_pages.PAGE, python_pages.page())
        self.waiting = ["README.md", "format_spec/BVG.md", "format_spec/ERRATA.md", *map(str, sorted(
            pathlib.Path("docs").rglob("*.md")))]
        while self.waiting:
            name = self.waiting.pop(0)
            if name not in self.written:
                self.write(name, self.page(name))

    def write(self, name, text):
        self.written.add(name)
        path = self.to / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def page(self, name):
        text = pathlib.Path(name).read_text(encoding="utf-8")
        if "<!-- Written by make.sh. -->" in text:
            self.options.append(name)
            text = option_pages.page(text.replace("<!-- Written by make.sh. -->\n", ""))
        # CommonMark continues an item at the indent of its text, this Markdown at four columns.
        text = with_links(text, lambda link: self.link(name, link))
        return re.sub(r"^  +(?=\d\. |[-*] )", "    ", text, flags=re.M)

    def link(self, page, link):
        """Where a link of `page` leads on the site."""
        target, hash_, anchor = link.partition("#")
        if re.match(r"[a-z]+:", link) or not target:
            return link
        folder = os.path.dirname(page)
        path = os.path.normpath(os.path.join(folder, target))
        if not os.path.exists(path) or path.startswith(".."):
            raise SystemExit("site: %s: no such file: %s" % (page, link))
        if path in self.places:
            path = self.places[path]
        elif path.endswith((".jpg", ".png")):
            path = self.picture(path)
        elif path.endswith(".svg"):
            (self.to / path).parent.mkdir(parents=True, exist_ok=True)
            (self.to / path).write_bytes(pathlib.Path(path).read_bytes())
        elif os.path.isfile(os.path.join(path, "README.md")):
            path += "/README.md"
            self.waiting.append(path)
        elif path.endswith(".md"):
            self.waiting.append(path)
        else:
            path = self.source(path)
        return os.path.relpath(path, folder or ".") + hash_ + anchor

    def picture(self, path):
        """A picture as WebP, which has half the bytes."""
        name = os.path.splitext(path)[0] + ".webp"
        if name not in self.pictures:
            with Image.open(path) as image:
                image.thumbnail((PICTURE_WIDTH, PICTURE_WIDTH), Image.LANCZOS)
                (self.to / name).parent.mkdir(parents=True, exist_ok=True)
                image.save(self.to / name, quality=80, method=6)
                self.pictures[name] = image.size
        return name

    def source(self, path):
        """A page that shows a source, or those of a folder."""
        page = path + ("/files.md" if os.path.isdir(path) else ".md")
        page = re.sub(r"(^|/)\.", r"\1", page)  # mkdocs leaves hidden files out
        if page not in self.written:
            files = [path]
            if os.path.isdir(path):
                files = sorted(str(file) for file in pathlib.Path(path).iterdir()
                               if file.is_file() and file.suffix in LANGUAGES)
            texts = {file: pathlib.Path(file).read_text(encoding="utf-8", errors="replace") for file in files}
            full = sum(text.count("\n") for text in texts.values()) <= MOST_LINES
            out = ["# " + path + ("/" if os.path.isdir(path) else "")]
            for file, text in texts.items():
                if file != path:
                    out.append("## " + os.path.basename(file))
                language = LANGUAGES.get(os.path.splitext(file)[1], "text")
                if not full:
                    about, _ = api_pages.comment_lines(text.split("\n"), 0)
                    text = "\n".join("// " + line for line in about or ["%d lines" % text.count("\n")])
                out.append("~~~~%s\n%s\n~~~~" % (language, text.rstrip("\n")))
            self.write(page, "\n\n".join(out) + "\n")
        return page

    def navigation(self):
        """The tables of docs/README.md: a heading is a tab, a row with many links a group at its end."""
        tabs = [("Home", ["README.md", INDEX], [])]
        for line in pathlib.Path(INDEX).read_text(encoding="utf-8").split("\n"):
            if line.startswith("## "):
                tabs.append((line[len("## "):].partition(":")[0], [], []))
            _, pages, groups = tabs[-1]
            links = [link for _, link in LINK.findall(line)] if len(tabs) > 1 else []
            found = [os.path.normpath(os.path.join("docs", self.link(INDEX, link))) for link in links]
            if any(link.endswith(".h") for link in links):
                pages.append(python_pages.PAGE)
                groups.append({"Headers of the libraries": self.api_names})
            elif len(found) > 4:
                groups.append({"Options of the programs": found})
            else:
                pages += [page for page in found if page not in pages]
        history = next(pages for _, pages, _ in tabs if "docs/history/README.md" in pages)
        history += sorted(name for name in self.written if name.startswith("docs/history/") and name not in history)
        missing = [name for name in self.written if name.startswith("docs/") and name not in str(tabs)]
        if missing:
            raise SystemExit("site: docs/README.md has no link to " + ", ".join(sorted(missing)))
        return [{name: pages + groups} for name, pages, groups in tabs]
