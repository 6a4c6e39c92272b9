#!/usr/bin/env python3
"""Draws the floors and rooms of check_floors.py as docs/architecture.svg: draw_rooms.py SOURCE_FOLDER [--check]

--check writes nothing, and fails if the picture is another one.
"""

import pathlib
import sys

from check_floors import FLOORS, ROOMS

WIDTH, GAP, PADDING = 1180, 12, 12
LINE, HEADER = 36, 34  # heights, pixels
OFFLINE, RUN_TIME, SHARED = "#e7efe2", "#e3ebf5", "#f3ece0"

# From top to bottom, what stands side by side: the share of the width, colour, title, purpose, and floors of ROOMS or
# words.
STORIES = [
    [(1, SHARED, "bindings", "all of it from other languages", ["c", "python", "web"])],
    [(0.52, OFFLINE, "tools, data", "the programs of the offline side",
      ["pbm-build", "pbm-validate", "pbm-info", "pbm-export", "pbm-sample"]),
     (0.48, RUN_TIME, "runtime/viewer", "the programs that draw", "runtime/viewer")],
    [(0.52, OFFLINE, "tools/pbm-build/pbm_build", "a Surface becomes a model", "tools/pbm-build/pbm_build"),
     (0.48, RUN_TIME, "runtime/pbm_render", "pictures", "runtime/pbm_render")],
    [(0.52, OFFLINE, "tools/pbm_scan", "a scan becomes a Surface", "tools/pbm_scan"),
     (0.24, RUN_TIME, "pbm_bake", "shadows", ["shadow rays", "shadow maps"]),
     (0.24, RUN_TIME, "pbm_surface", "within voxels", ["surface_offsets", "carried_offsets"])],
    [(1, SHARED, "format_spec/pbm_format", "the one implementation of BVG.md", "format_spec/pbm_format")],
    [(0.52, SHARED, "system", "knows nothing of points", "system"),
     (0.48, SHARED, "command_line", "shared by all programs", ["options", "help", "errors"])],
]
OWN_FILES = {"system": "error, bytes", "tools/pbm_scan": "formats", "tools/pbm-build/pbm_build": "pipeline"}

STYLE = (".t{font-size:16px;font-weight:bold;fill:#1d2833}.n{font-size:13px;fill:#4a5866}.r{font-size:13px;fill:#1d2833}"
         ".k{fill:#8a5a1d;font-weight:bold}")
LEGEND = ("Includes go down only: from a floor to floors below it, and within a floor from a room to rooms with a "
          "smaller number.")


def rooms_of(content):
    """(number or "", name) of each room."""
    if isinstance(content, list):
        return [("", name) for name in content]
    return [(rank, OWN_FILES[content] if room == "." else room)
            for rank, rooms in enumerate(ROOMS[content], 1) for room in rooms.split()]


def lines_of(rooms, width):
    """The rooms in lines no wider than that; with each room the width that its words need."""
    lines, used = [[]], 0
    for number, name in rooms:
        needed = 7.2 * len(f"{number} {name}") + 20
        if lines[-1] and used + GAP / 2 + needed > width:
            lines.append([])
            used = 0
        used += needed + (GAP / 2 if lines[-1] else 0)
        lines[-1].append((number, name, needed))
    return lines


def box(x, y, width, height, colour, edge, radius):
    return (f'<rect x="{x:.0f}" y="{y:.0f}" width="{width:.0f}" height="{height:.0f}" rx="{radius}" fill="{colour}" '
            f'stroke="{edge}"/>')


def floor(x, y, width, height, colour, title, purpose, lines):
    yield box(x, y, width, height, colour, "#3a4a5a", 8)
    yield f'<text x="{x + PADDING:.0f}" y="{y + 23:.0f}" class="t">{title}</text>'
    yield f'<text x="{x + width - PADDING:.0f}" y="{y + 23:.0f}" class="n" text-anchor="end">{purpose}</text>'
    inside = width - 2 * PADDING
    for row, line in enumerate(lines):
        spare = (inside - sum(needed for _, _, needed in line) - GAP / 2 * (len(line) - 1)) / len(line)
        left, top = x + PADDING, y + HEADER + row * LINE
        for number, name, needed in line:
            yield box(left, top, needed + spare, LINE - 8, "#ffffff", "#8a98a6", 5)
            label = f'<tspan class="k">{number}</tspan> {name}' if number else name
            yield f'<text x="{left + (needed + spare) / 2:.0f}" y="{top + 19:.0f}" class="r" text-anchor="middle">{label}</text>'
            left += needed + spare + GAP / 2


def picture():
    y, parts = 20, []
    for story in STORIES:
        free = WIDTH - 40 - GAP * (len(story) - 1)
        boxes = [(free * share, rest, lines_of(rooms_of(content), free * share - 2 * PADDING))
                 for share, *rest, content in story]
        height = HEADER + LINE * max(len(lines) for _, _, lines in boxes) + 4
        x = 20
        for width, rest, lines in boxes:
            parts += floor(x, y, width, height, *rest, lines)
            x += width + GAP
        y += height + GAP
    parts.append(f'<text x="20" y="{y + 12}" class="n">{LEGEND}</text>')
    height = y + 26
    return "\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" '
        'font-family="Helvetica, Arial, sans-serif">',
        f"<style>{STYLE}</style>", f'<rect width="{WIDTH}" height="{height}" fill="#fbfbf9"/>', *parts, "</svg>", ""])


def main():
    drawn = {content for story in STORIES for *_, content in story if isinstance(content, str)}
    missing = ROOMS.keys() - drawn - {"data/pbm-sample"}
    if missing or not drawn <= FLOORS.keys():
        sys.exit(f"draw_rooms.py: STORIES lack {sorted(missing)}")
    path = pathlib.Path(sys.argv[1], "docs/architecture.svg")
    if sys.argv[2:] != ["--check"]:
        path.write_text(picture())
    elif path.read_text() != picture():
        sys.exit("docs/architecture.svg does not show the rooms of check_floors.py: run tests/floors/draw_rooms.py .")
    return 0


if __name__ == "__main__":
    sys.exit(main())
