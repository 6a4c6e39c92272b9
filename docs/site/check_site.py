"""Checks a site: every link and anchor leads somewhere, nothing comes from another host, pages are not heavy."""

import html.parser
import json
import os
import re
import urllib.parse

MOST_PICTURE_BYTES = 300_000  # of a page other than the gallery


class Page(html.parser.HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.links, self.anchors, self.loaded, self.doubled = [], set(), [], []
        with open(path, encoding="utf-8") as file:
            self.feed(file.read())

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        if values.get("id"):
            if values["id"] in self.anchors:
                self.doubled.append(values["id"])
            self.anchors.add(values["id"])
        if tag == "a" and "href" in values:
            self.links.append(values["href"] or "")
        for name in ("src", "srcset", "data", "poster") + (("href",) if tag in ("link", "use", "image") else ()):
            if values.get(name):
                self.loaded.append(values[name])


def check(site):
    """What is wrong with the site, one line each, and how much was checked."""
    site = os.path.abspath(site)
    names = [os.path.join(folder, name) for folder, _, all_ in os.walk(site) for name in all_ if name.endswith(".html")]
    pages = {path: Page(path) for path in names}
    wrong, counted = [], 0
    for path, page in pages.items():
        name = os.path.relpath(path, site)
        wrong += ["%s: two anchors %s" % (name, anchor) for anchor in page.doubled]
        for link in page.links + page.loaded:
            counted += 1
            parts = urllib.parse.urlsplit(link)
            if parts.scheme in ("http", "https", "data", "javascript", "mailto") or parts.netloc:
                if link in page.loaded and parts.scheme != "data" or parts.scheme not in ("http", "https", "data"):
                    wrong.append("%s: loads or runs %s" % (name, link))
                continue
            target = os.path.normpath(os.path.join(os.path.dirname(path), urllib.parse.unquote(parts.path))) \
                if parts.path else path
            anchor = urllib.parse.unquote(parts.fragment)
            if not target.startswith(site + os.sep) or not os.path.isfile(target):
                wrong.append("%s: no such page: %s" % (name, link))
            elif anchor and target in pages and anchor not in pages[target].anchors and not anchor.startswith("__"):
                wrong.append("%s: no such anchor: %s" % (name, link))
        pictures = {link for link in page.loaded if link.endswith((".webp", ".svg", ".png", ".jpg"))}
        size = sum(os.path.getsize(os.path.join(os.path.dirname(path), link)) for link in pictures
                   if os.path.isfile(os.path.join(os.path.dirname(path), link)))
        if size > MOST_PICTURE_BYTES and not name.endswith("gallery.html"):
            wrong.append("%s: pictures of %d bytes, more than %d" % (name, size, MOST_PICTURE_BYTES))
    for folder, _, all_ in os.walk(site):
        for name in all_:
            if name.endswith(".css"):
                with open(os.path.join(folder, name), encoding="utf-8") as file:
                    loaded = re.findall(r"url\([\"']?(https?:[^)]*)", file.read())
                wrong += ["%s: loads %s" % (name, url) for url in loaded]
    with open(os.path.join(site, "search", "search_index.json"), encoding="utf-8") as file:
        entries = json.load(file)["docs"]
    for entry in entries:
        page, _, anchor = entry["location"].partition("#")
        found = pages.get(os.path.join(site, page or "index.html"))
        if found is None or anchor and urllib.parse.unquote(anchor) not in found.anchors:
            wrong.append("search: no such place: %s" % entry["location"])
    return wrong, "%d pages, %d links, %d places that search finds" % (len(pages), counted, len(entries))
