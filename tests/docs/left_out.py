"""Blocks of docs/ and of the README that no test runs as they stand: page, a piece of their text, and why not."""

BUILDS = "builds everything from the sources, as every run of the tests does before it begins"
TESTS = "builds everything from the sources and runs tests, of which this is one"
INSTALLS = "installs packages on this machine"
CHANGE = "a piece of the change to the sources that the page describes"
BROWSER = "a part of a web page: scripts/test_web.sh shows such pages in Chromium"

LEFT_OUT = [
    ("README.md", "scripts/demo.sh", INSTALLS),
    ("docs/tutorial/first-model.md", "scripts/demo.sh", INSTALLS),
    ("docs/explanation/checks.md", "check_mutations", "takes hours: nightly.check_mutations"),
    ("docs/explanation/checks.md", "campaign.py", "searches for hours"),
    ("docs/explanation/determinism.md", "compilers.sh", "takes hours: nightly.compilers"),
    ("docs/explanation/reliability.md", "long.sh", "takes hours; ctest -R faults takes a sample of each campaign"),
    ("docs/how-to/add-a-rule.md", "- 3.4.7", CHANGE),
    ("docs/how-to/add-a-rule.md", '{"parameter.grid"', CHANGE),
    ("docs/how-to/add-a-rule.md", "grid.edge() > 1e12", CHANGE),
    ("docs/how-to/add-a-rule.md", "files.add(", CHANGE),
    ("docs/how-to/add-a-rule.md", "write_vectors", CHANGE),
    ("docs/how-to/add-a-rule.md", "need(m.voxel", CHANGE),
    ("docs/how-to/add-a-rule.md", "--target check_mutations", CHANGE),
    ("docs/how-to/add-an-attribute.md", "cmake --build", TESTS),
    ("docs/how-to/add-an-input-format.md", "is_nam(", CHANGE),
    ("docs/how-to/add-an-input-format.md", "ScanFormat{", CHANGE),
    ("docs/how-to/add-an-input-format.md", "cmake --build", TESTS),
    ("docs/how-to/add-an-option.md", "--thin", CHANGE),
    ("docs/how-to/add-an-option.md", "make.sh", "writes pages of the sources; cli.reference_pages says what they are"),
    ("docs/how-to/add-an-option.md", "cmake --build", TESTS),
    ("docs/how-to/build-system.md", "bazel_dep", "Bazel's: build_systems.bazel builds the example, which has the same lines"),
    ("docs/how-to/build-system.md", "pbm_asset(", "Bazel's: build_systems.bazel builds the example, which has the same lines"),
    ("docs/how-to/install.md", "scripts/install_packages.sh   ", BUILDS),
    ("docs/how-to/install.md", "cpack", "makes and installs packages: nightly.packages"),
    ("docs/how-to/install.md", "static_libraries.sh", "builds everything: nightly.static"),
    ("docs/how-to/install.md", "buildah", "builds a container: nightly.container"),
    ("docs/how-to/make-the-site.md", "make_site.sh", "installs packages; nightly.site makes the site"),
    ("docs/how-to/put-a-scan-on-a-page.md", "install_packages.sh web", "installs 800 MB; scripts/test_web.sh does it"),
    ("docs/how-to/put-a-scan-on-a-page.md", "./tiger.pbvg", BROWSER),
    ("docs/how-to/put-a-scan-on-a-page.md", "<!doctype html>", BROWSER),
    ("docs/how-to/put-a-scan-on-a-page.md", "hotspot-paw", BROWSER),
    ("docs/how-to/put-a-scan-on-a-page.md", "positionFromPoint", BROWSER),
    ("docs/how-to/put-a-scan-on-a-page.md", "totalProgress", BROWSER),
    ("docs/how-to/put-a-scan-on-a-page.md", "location ~", "of a server that is not installed here"),
    ("docs/how-to/put-a-scan-on-a-page.md", "add_header", "of a server that is not installed here"),
    ("docs/how-to/use-from-c.md", " WORDS ", "the test `install` links libpbm.a, with the words that pkg-config prints"),
    ("docs/how-to/use-from-python.md", "make_wheel.sh", "makes the wheel and an environment for it: bindings.wheel, nightly"),
    ("docs/how-to/use-the-libraries.md", "add_subdirectory", "install.subproject builds such a project"),
    ("docs/how-to/validate-in-a-pipeline.md", "repos:", "build_systems.hook uses it"),
    ("docs/how-to/validate-in-a-pipeline.md", "uses: ./pbm", "build_systems.action runs the action"),
    ("docs/reference/cmake.md", "[SOURCES scan...]", "the form of a call"),
]

# Languages of blocks that hold no commands.
NO_COMMANDS = {"", "text", "diff"}
