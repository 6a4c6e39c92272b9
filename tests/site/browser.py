"""The site in a browser, opened from files: browser.py SITE

No page is wider than a telephone, asks another host or fails in a script; search finds options, rules and codes.
Skipped where Chromium is not installed or the site could not be made.
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

SEARCHES = {"--fill-holes": "docs/reference/pbm-build.html#--fill-holes", "3.2.14": "format_spec/BVG.html#3.2.14",
            "hash.chunk": "docs/reference/validator-codes.html#hash.chunk"}
WIDTH, HEIGHT = 390, 844
PATIENCE = 60  # seconds for one page


class Browser:
    """Chromium without a window, spoken to through a pipe."""

    def __init__(self, program, profile):
        to_browser, self.write_end = os.pipe()
        self.read_end, from_browser = os.pipe()

        def descriptors():
            os.dup2(to_browser, 3 + 100), os.dup2(from_browser, 4 + 100)
            os.dup2(103, 3), os.dup2(104, 4)

        self.process = subprocess.Popen(
            [program, "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", "--hide-scrollbars",
             "--user-data-dir=" + profile, "about:blank"], preexec_fn=descriptors, close_fds=False,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_browser), os.close(from_browser)
        self.buffer, self.number, self.events = b"", 0, []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = None
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network"):
            self.call(domain + ".enable")
        self.call("Emulation.setDeviceMetricsOverride", width=WIDTH, height=HEIGHT, deviceScaleFactor=1, mobile=True)

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if getattr(self, "session", None):
            message["sessionId"] = self.session
        os.write(self.write_end, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.read()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(answer["error"])
                return answer["result"]
            self.events.append(answer)

    def read(self):
        while b"\0" not in self.buffer:
            piece = os.read(self.read_end, 1 << 20)
            if not piece:
                raise RuntimeError("the browser has ended")
            self.buffer += piece
        message, _, self.buffer = self.buffer.partition(b"\0")
        return json.loads(message)

    def wait(self, expression):
        """The value of `expression` once it is true, or None."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            value = self.call("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")
            if value:
                return value
            time.sleep(0.05)
        return None

    def search(self, words):
        """Where the first result of a search leads."""
        self.wait("document.getElementById('__search').click() || true")
        self.wait("document.querySelector('.md-search__input').focus() || true")
        time.sleep(0.1)  # the theme reads the field a moment after the focus; nobody types that soon
        self.call("Input.insertText", text=words)
        self.wait("document.activeElement.dispatchEvent(new KeyboardEvent('keyup', {bubbles: true}))")
        return self.wait("[...document.querySelectorAll('.md-search-result__item:first-child a')]"
                         ".map(link => link.pathname + link.hash).join(' ')") or "nothing"

    def open(self, url):
        self.events.clear()
        self.call("Page.navigate", url=url)
        if not self.wait("location.href == %s && document.readyState == 'complete'" % json.dumps(url)):
            raise RuntimeError("does not open: " + url)

    def end(self):
        self.process.terminate()
        self.process.wait()


def main(site):
    program = shutil.which("chromium")
    if program is None or not os.path.isfile(os.path.join(site, "index.html")):
        print("chromium is not installed, or no site was made: skipped")
        return 77
    wrong = []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(program, profile)
        pages = sorted(pathlib.Path(site).resolve().rglob("*.html"))
        for page in pages:
            browser.open(page.as_uri())
            width = browser.call("Runtime.evaluate", expression="document.documentElement.scrollWidth",
                                returnByValue=True)["result"]["value"]
            if width > WIDTH:
                wrong.append("%s: %d pixels wide, more than a telephone" % (page, width))
            for event in browser.events:
                parameters = event.get("params", {})
                url = parameters.get("request", {}).get("url", "")
                if url and not url.startswith(("file:", "data:", "blob:")):
                    wrong.append("%s: asks for %s" % (page, url))
                if event["method"] == "Runtime.exceptionThrown":
                    wrong.append("%s: %s" % (page, parameters["exceptionDetails"]["exception"]["description"]))
        start = pathlib.Path(site).resolve() / "index.html"
        for words, place in SEARCHES.items():
            browser.open(start.as_uri())
            first = browser.search(words)
            if place not in first:
                wrong.append("search for %s: %s is not in the first result: %s" % (words, place, first))
        browser.end()
    print("\n".join(wrong) or "%d pages, %d searches" % (len(pages), len(SEARCHES)))
    return 1 if wrong else 0


sys.exit(main(sys.argv[1]))
