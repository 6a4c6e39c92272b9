"""The parts of the site that need no package: parts.py SOURCE_FOLDER

Options and headers become pages in which nothing is lost, and the checker of links sees each kind of fault.
"""

import json
import os
import re
import sys
import tempfile
import unittest

SOURCE = sys.argv.pop()
sys.path.insert(0, os.path.join(SOURCE, "docs/site"))
import api_pages
import check_site
import content
import option_pages

os.chdir(SOURCE)


BOX = """// Boxes.
#pragma once

namespace pbm {

class Later;

// A box.
class Box {
  public:
    Box(int edge) : edge_(edge) {
        grow();
    }
    int edge() const { return edge_; } // of all sides

  private:
    int edge_;
};

// Volume of `box`.
inline long volume(const Box &box) {
    return box.edge();
}
} // namespace pbm
"""


class Options(unittest.TestCase):
    def test_each_option_of_each_program_has_an_anchor(self):
        for name in filter(re.compile(r"pbm-\w+\.md").fullmatch, os.listdir("docs/reference")):
            with open("docs/reference/" + name, encoding="utf-8") as file:
                text = file.read()
            page = option_pages.page(text)
            for option in re.findall(r"^ {2,7}(?:-\w, )?(--[a-z][\w-]*)", text, re.M):
                self.assertEqual(page.count("{#%s .option" % option), 1, name + " " + option)

    def test_a_help_in_another_form_is_refused(self):
        for line in ("             without an option", "Topic:\n          deep"):
            with self.assertRaises(SystemExit):
                option_pages.page("```text\nDoes it.\n%s\n```\n" % line)


class Headers(unittest.TestCase):
    def test_a_header_becomes_text_headings_and_declarations(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "box.h")
            with open(path, "w", encoding="utf-8") as file:
                file.write(BOX)
            header = api_pages.Header(path, "box.h.md")
        out, names = api_pages.declarations(header, 2, [])
        self.assertEqual(header.about, ["Boxes."])
        self.assertEqual(names, ["Box", "volume"])
        self.assertEqual(out, [
            "## `Box` {#Box}", "A box.", "```cpp\nclass Box {\n  public:\n    Box(int edge);\n    int edge() const;"
            " // of all sides\n};\n```", "## `volume` {#volume}", "Volume of `box`.",
            "```cpp\ninline long volume(const Box &box);\n```"])

    def test_the_doors_lead_to_their_declarations(self):
        doors = ["format_spec/pbm/format.h", "runtime/pbm/render.h", "runtime/pbm/bake.h", "tools/pbm/scan.h"]
        pages, names, places = api_pages.pages(doors)
        for name in ("Reader", "load_model", "StreamedModel", "bake_light", "Surface", "Error", "kMagic"):
            self.assertIn("{#%s}" % name, pages[names[name].partition("#")[0]])
        for page in pages.values():
            self.assertNotIn("private:", page)
        self.assertIn("system/error.h", places)


class Rules(unittest.TestCase):
    def test_each_rule_of_the_validator_is_an_anchor(self):
        with open(content.SPECIFICATION, encoding="utf-8") as file:
            content.find_numbers(file.read())
        with open(content.CODES, encoding="utf-8") as file:
            cells = re.findall(r"\| ((?:[\d.]+(?:, )?)+)(?= \|)", file.read())
        rules = [rule for cell in cells for rule in cell.split(", ") if "." in rule]
        self.assertGreater(len(rules), 100)
        self.assertEqual([rule for rule in rules if rule not in content.numbers], [])


class Links(unittest.TestCase):
    def faults(self, body):
        with tempfile.TemporaryDirectory() as site:
            os.makedirs(os.path.join(site, "search"))
            with open(os.path.join(site, "search/search_index.json"), "w", encoding="utf-8") as file:
                json.dump({"docs": [{"location": "index.html#here"}]}, file)
            with open(os.path.join(site, "big.webp"), "wb") as file:
                file.write(bytes(check_site.MOST_PICTURE_BYTES + 1))
            with open(os.path.join(site, "index.html"), "w", encoding="utf-8") as file:
                file.write('<p id="here">' + body)
            return check_site.check(site)[0]

    def test_each_fault_is_seen(self):
        for body, fault in [
                ('<a href="other.html">', "no such page"), ('<a href="#there">', "no such anchor"),
                ('<a href="../../etc/passwd">', "no such page"), ('<a href=".">', "no such page"),
                ('<img src="none.webp">', "no such page"), ('<img src="big.webp">', "pictures of"),
                ('<script src="https://example.org/a.js">', "loads"), ('<link href="//example.org/a.css">', "loads"),
                ('<a href="javascript:run()">', "loads or runs"), ('<p id="here">', "two anchors")]:
            found = self.faults(body)
            self.assertEqual(len(found), 1, (body, found))
            self.assertIn(fault, found[0])

    def test_what_is_right_is_accepted(self):
        self.assertEqual(self.faults('<a href="#here"><a href="index.html#here"><a href="https://example.org/">'), [])


unittest.main(verbosity=1)
