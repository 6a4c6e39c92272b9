#!/usr/bin/env python3
"""Makes the documentation site: make_site.py OUT

OUT is a folder to be made, or a site made before, which is replaced. Runs in the root of the tree.
"""

import json
import logging
import os
import re
import shutil
import sys
import tempfile

import mkdocs.commands.build
import mkdocs.config

import check_site
import content
import site_pages

HERE = os.path.dirname(os.path.abspath(__file__))
MARK = "search/offline.js"  # says that a folder is a site of ours


def version():
    with open("CMakeLists.txt", encoding="utf-8") as file:
        return re.search(r"project\(pbm VERSION ([\d.]+)", file.read())[1]


def configuration(work, pages):
    config = mkdocs.config.load_config(
        os.path.join(HERE, "mkdocs.yml"), strict=True, nav=pages.navigation(), docs_dir=os.path.join(work, "pages"),
        site_dir=os.path.join(work, "site"), copyright="PBM %s. BSD 3-Clause licence." % version())
    config["plugins"].events["page_content"].append(content.on_page_content)
    return config


def finish_search(site):
    """Search finds rules and codes. A page that was opened from a file may neither fetch the index nor start a worker:
    it gets both as a script."""
    path = os.path.join(site, "search/search_index.json")
    with open(path, encoding="utf-8") as file:
        index = json.load(file)
    index["docs"] += [{"location": place, "title": title, "text": text} for place, title, text in content.found]
    with open(path, "w", encoding="utf-8") as file:
        json.dump(index, file, separators=(",", ":"), ensure_ascii=False)
    folder = os.path.join(site, "assets/javascripts/workers")
    (worker,) = [name for name in os.listdir(folder) if name.endswith(".js")]
    with open(os.path.join(folder, worker), encoding="utf-8") as file:
        source = re.sub(r"//# sourceMappingURL.*", "", file.read())
    with open(os.path.join(site, MARK), "w", encoding="utf-8") as file:
        file.write("__search.index = Promise.resolve(%s);\n__search.worker = URL.createObjectURL(new Blob([%s]));\n" %
                   (json.dumps(index, separators=(",", ":"), ensure_ascii=False), json.dumps(source)))


def remove_unused(site):
    """Files that only a server or a developer of the theme reads."""
    for folder, _, names in os.walk(site):
        for name in names:
            path = os.path.join(folder, name)
            if name.endswith(".map") or name.startswith("sitemap.xml") or name == "404.html" or "/lunr/" in path:
                os.remove(path)
            elif name.endswith((".js", ".css")):
                with open(path, encoding="utf-8") as file:
                    text = file.read()
                with open(path, "w", encoding="utf-8") as file:
                    file.write(re.sub(r"(//# |/\*# )sourceMappingURL=\S*( \*/)?", "", text))
    shutil.rmtree(os.path.join(site, "assets/javascripts/lunr"), ignore_errors=True)


def place(site, out):
    """Moves the site to `out`; an older one stays until the new one is complete."""
    new, old = out + ".new", out + ".old"
    shutil.rmtree(new, ignore_errors=True)
    try:
        shutil.copytree(site, new)
    except OSError:
        shutil.rmtree(new, ignore_errors=True)
        raise
    if os.path.isdir(out):
        os.rename(out, old)
    os.rename(new, out)
    shutil.rmtree(old, ignore_errors=True)


def main(arguments):
    if len(arguments) != 1 or arguments[0].startswith("-"):
        raise SystemExit("usage: make_site.sh OUT")
    out = os.path.abspath(arguments[0])
    if os.path.exists(out) and not os.path.isfile(os.path.join(out, MARK)) and not (
            os.path.isdir(out) and not os.listdir(out)):
        raise SystemExit("site: %s: is there and is no site; name another folder" % out)
    os.makedirs(os.path.dirname(out), exist_ok=True)
    os.chdir(os.path.join(HERE, "../.."))
    with tempfile.TemporaryDirectory() as work:
        pages = content.pages = site_pages.Pages(os.path.join(work, "pages"))
        with open(content.SPECIFICATION, encoding="utf-8") as file:
            content.find_numbers(file.read())
        content.find_words(pages.options, content.CODES)
        logging.getLogger("mkdocs").addHandler(logging.StreamHandler())
        logging.getLogger("mkdocs").setLevel(logging.WARNING)
        mkdocs.commands.build.build(configuration(work, pages))
        site = os.path.join(work, "site")
        finish_search(site)
        remove_unused(site)
        wrong, checked = check_site.check(site)
        if wrong:
            raise SystemExit("\n".join(["site: " + line for line in wrong] + ["site: %d faults; %s is not made" %
                                                                             (len(wrong), arguments[0])]))
        place(site, out)
    size = sum(os.path.getsize(os.path.join(folder, name)) for folder, _, names in os.walk(out) for name in names)
    print("site: %s: %s, %.1f MB" % (os.path.join(arguments[0], "index.html"), checked, size / 1e6))


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except OSError as error:
        reason = error.strerror or "not all of it can be written; is the disk full?"  # copies are told of one by one
        raise SystemExit("site: %s: %s" % (error.filename or sys.argv[1], reason)) from None
