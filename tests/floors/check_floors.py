#!/usr/bin/env python3
"""Includes go down only, between floors and between rooms; every third-party library has one home; no folder is crowded;
what is read first is short; programs link what their floor may.

  check_floors.py includes SOURCE_FOLDER     every file of ours
  check_floors.py links PROGRAM_FOLDER       every program there that has a rule
  check_floors.py rooms SOURCE_FOLDER        docs/architecture.md names every floor and room, lowest first
  check_floors.py self-test                  feeds each rule something that breaks it
"""

import pathlib
import re
import subprocess
import sys

# Folder of ours -> the first words of the includes that its files may name besides those of their own floor. A file may
# always include its neighbours by bare name.
FLOORS = {
    "system": set(),
    "format_spec/pbm_format": {"system"},
    "format_spec/pbm": {"system", "pbm_format"},
    "runtime/pbm": {"system", "pbm_format", "pbm_render", "pbm_bake"},
    "tools/pbm": {"pbm_scan"},
    "runtime/pbm_surface": {"system", "pbm_format"},
    "runtime/pbm_bake": {"system", "pbm_format", "pbm_surface"},
    "runtime/pbm_render": {"system", "pbm_format", "pbm_surface"},
    "runtime/viewer": {"system", "pbm_format", "pbm_bake", "pbm_render", "command_line"},
    "tools/pbm_scan": {"system", "pbm_format"},
    "tools/pbm-build/pbm_build": {"system", "pbm_format", "pbm_surface", "pbm_bake", "pbm_scan"},
    "tools/pbm-build/options": {"system", "pbm_format", "pbm_bake", "pbm_scan", "pbm_build", "command_line"},
    "tools/pbm-build/sources": {"system", "pbm_format", "pbm_scan", "pbm_build"},
    "tools/pbm-build/pbm_batch": {
        "system", "pbm_format", "pbm_scan", "pbm_build", "options", "sources", "command_line"},
    "tools/pbm-build": {
        "system", "pbm_format", "pbm_bake", "pbm_scan", "pbm_build", "options", "sources", "pbm_batch", "command_line"},
    "command_line": {"system"},
    "tools/pbm-validate": {"system", "pbm_format", "command_line"},
    "tools/pbm-info": {"system", "pbm_format", "command_line"},
    "tools/pbm-export": {"system", "pbm_format", "command_line"},
    "data/pbm-sample": {"system", "command_line"},
    "bindings/c": {"system", "pbm_format", "pbm_render", "pbm_scan", "pbm_build", "pbm-build"},
    "bindings/web": set(),
    "bindings/web/bench": {"system", "pbm_format"},
}

# Rooms of a floor, lowest first; rooms on one line do not include each other. "." stands for the files of the floor's own
# folder.
ROOMS = {
    "system": [".", "simd threads files", "processes"],
    "format_spec/pbm_format": ["law", "hashes", "model", "levels", "container", "streams", "chunks", "rasters", "reading", "checking", "writing"],
    "runtime/pbm_render": [
        "camera picture", "appearance", "surroundings", "bricks", "splats shading", "detail", "fast fine reference tables"],
    "runtime/viewer": [
        "pictures finish", "options", "opening cameras", "navigation", "scene", "pbm-render pbm-view/light pbm-view/measure",
        "pbm-view/clipping", "pbm-view/window", "pbm-view/drawing", "pbm-view/opening", "pbm-view"],
    "tools/pbm_scan": ["surface", "text", "fields packing conventions", "images clouds", "gltf mesh ply e57 ptx las spz table", "."],
    "tools/pbm-build/pbm_build": [
        "report", "lattice surface", "images", "fields grid hole_filling", "winding", "mesh_repair", "voxels", "neighbours neighbourhoods",
        "normals radii texture offsets", "upsampling parts", "panorama", "scene", "preparing", "."],
    "data/pbm-sample": ["noise", "ammonite points", "ply", "."],
}

# Floors without a row of their own in docs/architecture.md: doors, and what the row of the folder above describes.
WITHOUT_ROW = {"format_spec/pbm", "runtime/pbm", "tools/pbm", "tools/pbm-build", "bindings/c", "bindings/web",
               "bindings/web/bench"}

# What needs an operating system, and the rooms of the floors that must do without it.
OPERATING_SYSTEM = re.compile(r"system/(files|processes)/")
PORTABLE = re.compile(
    r"format_spec/pbm_format/(?!writing/)|runtime/pbm_(surface|bake|render)/|bindings/c/(?!files|builder)|bindings/web/")

MOST_FILES = 17  # sources and headers that one folder shows
MOST_LINES = {"runtime/pbm_render/reference": 300}  # folders that are read first

# Header from outside -> the files that may include it; the first pattern that matches decides. A standard header that
# is not named here may be included anywhere.
HOMES = {
    r"zstd.*\.h": r"format_spec/pbm_format/(streams/frame|writing/frame_encoder)\.cpp|tools/pbm_scan/packing/compressed\.cpp",
    r"zlib\.h": r"tools/pbm_scan/packing/compressed\.cpp",
    r"xxh.*\.h": r"format_spec/pbm_format/hashes/(hash(_avx2|_avx512)?|unordered_hash)\.cpp",
    r"nlohmann/.*": r"format_spec/pbm_format/container/metadata\.cpp|command_line/json_report\.cpp|tools/.*\.cpp|tools/pbm_scan/gltf/gltf_json\.h|runtime/viewer/.*\.cpp",
    r"glm/.*": r"(runtime|tools|data|bindings)/.*",
    r"std(def|int)\.h": r"bindings/c/pbm\.h",
    r"pbm/pbm\.h": r"bindings/web/.*\.cpp",
    r"unwind\.h": r"bindings/web/landing_pads\.cpp",
    # In the builder only what runs once per sample or point, in programs once per pixel: vectors elsewhere are the compiler's.
    r"hwy/.*": (
        r"(system/simd|format_spec/pbm_format|runtime/pbm_(surface|bake|render))/.*\.(cpp|h)"
        r"|tools/pbm-build/pbm_build/\w+/(noise|short_normal|triangle_columns|triangle_mix|leaf_scan|plane_columns|outside_view)\.cpp"
        r"|runtime/viewer/pictures/row_filter\.cpp"
    ),
    r"(draco/.*|meshoptimizer\.h)": r"tools/pbm_scan/gltf/gltf_(draco|document)\.cpp|bench/.*",
    r"expat\.h": r"tools/pbm_scan/e57/e57_xml\.cpp",
    r"Eigen/.*": r"tools/pbm-build/pbm_build/hole_filling/sparse_cholesky\.cpp|bench/.*",
    r"OpenMesh/.*": r"tools/pbm-build/pbm_build/mesh_repair/half_edges\.cpp",
    r"CLI/.*": r"command_line/parse\.cpp",
    r"toml\+\+/.*": r"tools/pbm-build/options/recipe\.cpp",
    r"GLFW/.*": r"runtime/viewer/pbm-view/window/window\.cpp",
    r"(GL|epoxy)/.*": r"runtime/viewer/pbm-view/window/presenter\.cpp",
    r"(backends/)?imgui.*": r"runtime/viewer/pbm-view/window/(overlay|panel|start_page)\.cpp",
    r"isa-l/.*": r"runtime/viewer/pictures/image_writer\.cpp",
    r"OpenEXR/.*|dlfcn\.h": r"runtime/viewer/pictures/exr_writer\.cpp",
    r"(jpeglib|jerror)\.h": r"tools/pbm_scan/images/image_decoder\.cpp|runtime/viewer/pictures/jpeg_encoder\.cpp",
    r"stb/stb_easy_font\.h": r"runtime/pbm_render/appearance/legend\.cpp",
    r"png\.h|webp/.*": r"tools/pbm_scan/images/image_decoder\.cpp",
    r"stb/(?!stb_easy_font).*": r"tools/pbm_scan/images/stb_decoder\.cpp",
    r"tiffio\.h": r"tools/pbm_scan/images/tiff_decoder\.cpp",
    r"squish\.h": r"tools/pbm_scan/images/dds_decoder\.cpp",
    r"malloc\.h": r"system/processes/(this_process|paged_heap)\.cpp",
    r"pthread\.h": r"system/threads/(per_thread\.h|large_stack\.cpp)|system/processes/paged_heap\.cpp",
    r"thread": r"system/threads/(thread_pool\.h|parallel\.cpp|large_stack\.cpp)|system/processes/paged_heap\.cpp",
    r"(fcntl|unistd|spawn|poll|signal)\.h|sys/.*": r"system/(files|processes)/\w+\.cpp|command_line/progress_display\.cpp",
}
C_HEADERS = re.compile(r"[a-z_0-9]+")  # C++ standard headers have no dot

# Programs and what they may not need at run time.
WINDOWS = "libGL|libEGL|libOpenGL|libX11|libxcb|libwayland|libglfw|libepoxy"
LINKS = {
    "pbm-render": f"{WINDOWS}|libOpenMesh|libembree|libpng|libjpeg|libstb",
    "pbm-view": "libOpenMesh|libembree|libpng|libjpeg",
    "pbm-validate": f"{WINDOWS}|libOpenMesh|libembree|libpng|libisal|libjpeg|libstb",
    "pbm-info": f"{WINDOWS}|libOpenMesh|libembree|libpng|libisal|libjpeg|libstb",
    "pbm-export": f"{WINDOWS}|libOpenMesh|libembree|libpng|libisal|libjpeg|libstb",
    "pbm-build": f"{WINDOWS}|libembree|libisal",
    "pbm-sample": f"{WINDOWS}|libOpenMesh|libembree|libpng|libisal|libjpeg|libstb",
}

# Targets that the CMake files of a folder may not name.
CMAKE = {
    "system": r"pbm[_:]+(format|reading|checking|writing|render|build|scan|bake)\b|glm|OpenMesh|glfw|CLI11|zstd",
    "format_spec": r"pbm[_:]+(render|build|scan|bake)\b|glm|OpenMesh|glfw|CLI11",
    "command_line": r"pbm[_:]+(render|build|scan|bake)\b|OpenMesh|glfw",
    "runtime": r"pbm[_:]+(build|scan|sample)\b|OpenMesh|embree",
    "tools": r"pbm[_:]+render\b|glfw|embree",
    "tools/pbm_scan": r"pbm[_:]+(format|checking|writing|bake|build|batch)\b|OpenMesh|Eigen",
    "data": r"pbm[_:]+(render|build|scan)\b",
    "bindings": r"pbm[_:]+paged_heap\b|glfw|embree",
}


def room_of(floor, path):
    """The room of a file of that floor and its rank, or None: the longest name in ROOMS that its path starts with."""
    inside = path[len(floor) + 1:]
    if "/" not in inside:
        inside = "./" + inside
    named = [(room, rank) for rank, rooms in enumerate(ROOMS[floor]) for room in rooms.split()]
    fitting = [(room, rank) for room, rank in named if inside.startswith(room + "/")]
    return max(fitting, key=lambda found: len(found[0]), default=None)


def check_room(floor, path, header):
    """A file of `floor` includes one of the same floor."""
    mine, other = room_of(floor, path), room_of(floor, floor + "/" + header.split("/", 1)[1])
    if mine is None or other is None:
        return f"{path}: includes {header}, and one of the two lies in no room of ROOMS"
    if mine[0] == other[0] or other[1] < mine[1]:
        return None
    return f"{path}: includes {header}; '{other[0]}' is not below '{mine[0]}'"


def check_includes(path, text):
    """Violations of one file; `path` is relative to the source folder."""
    found = []
    floor = max((f for f in FLOORS if path.startswith(f + "/")), key=len, default=None)
    if floor is None:
        return [f"{path}: lies in no folder of FLOORS"]
    own = floor.split("/")[-1]
    if floor in ROOMS and room_of(floor, path) is None:
        found.append(f"{path}: lies in no room of ROOMS")
    for line in re.findall(r'^\s*#\s*include\s*([<"][^>"]+[>"])', text, re.MULTILINE):
        header = line[1:-1]
        top = header.split("/")[0]
        if header.startswith(".."):
            found.append(f"{path}: includes {header} by way of the parent folder")
        elif line[0] == '"' or top.startswith("pbm_"):
            if "/" in header and top != own and top not in FLOORS[floor]:
                found.append(f"{path}: includes {header}; {floor} may include {sorted(FLOORS[floor]) or 'none of us'}")
            elif OPERATING_SYSTEM.match(header) and PORTABLE.match(path):
                found.append(f"{path}: includes {header}, and must do without an operating system")
            elif "/" in header and top == own and floor in ROOMS:
                problem = check_room(floor, path, header)
                if problem:
                    found.append(problem)
        else:
            home = next((home for pattern, home in HOMES.items() if re.fullmatch(pattern, header)), None)
            if home is None:
                if not C_HEADERS.fullmatch(header):
                    found.append(f"{path}: <{header}> has no home in HOMES")
            elif not re.fullmatch(home, path):
                found.append(f"{path}: <{header}> belongs in {home}")
    return found


def check_folder(folder, count):
    return [f"{folder}: shows {count} sources, more than {MOST_FILES}: which rooms does it hide?"] if count > MOST_FILES else []


def check_length(folder, lines):
    most = MOST_LINES.get(folder, lines)
    return [f"{folder}: has {lines} lines, more than {most}: it is to be plain"] if lines > most else []


def check_cmake(path, text):
    text = re.sub(r"#.*", "", text)
    found = [re.search(names, text) for folder, names in CMAKE.items() if path.startswith(folder + "/")]
    return [f"{path}: names {match[0]}" for match in found if match]


def check_links(program, libraries):
    """`libraries`: what ldd prints."""
    if "not found" in libraries:
        return [f"{program}: a library is missing: {libraries}"]
    needed = re.findall(r"^\s*(\S+)", libraries, re.MULTILINE)
    return [f"{program}: needs {name}" for name in needed if re.match(LINKS[program], name)]


def all_includes(source):
    found, files, shown, lines = [], 0, {}, {}
    for top in ("system", "format_spec", "command_line", "runtime", "tools", "data", "bindings"):
        for file in sorted((source / top).rglob("*")):
            path = file.relative_to(source).as_posix()
            if file.suffix in (".h", ".cpp"):
                text = file.read_text()
                found += check_includes(path, text)
                folder = file.parent.relative_to(source).as_posix()
                shown[folder] = shown.get(folder, 0) + 1
                lines[folder] = lines.get(folder, 0) + len(text.splitlines())
                files += 1
            elif file.name == "CMakeLists.txt":
                found += check_cmake(path, file.read_text())
                files += 1
    for folder, count in shown.items():
        found += check_folder(folder, count) + check_length(folder, lines[folder])
    for top in ("tests", "bench", "examples"):
        for file in (source / top).rglob("*.cpp"):
            if "#include <CLI/" in file.read_text():
                found.append(f"{file.relative_to(source)}: <CLI/...> belongs in command_line/parse.cpp")
            files += 1
    return found, files


def check_page(page):
    """What the table of floors in docs/architecture.md lacks. A row has a folder, a purpose, and its rooms in backquotes."""
    rows = [line.split("|") for line in page.splitlines() if line.startswith("| `")]
    found = []
    for floor in FLOORS.keys() - WITHOUT_ROW:
        row = next((row for row in rows if len(row) == 5 and re.search(rf"[`/]{floor.split('/')[-1]}/?`", row[1])), None)
        if row is None:
            found.append(f"docs/architecture.md: no row of the table of floors names {floor}/")
            continue
        below = here = -1  # where the last room of a lower rank is named, and that of this rank
        for rooms in ROOMS.get(floor, []):
            for room in (room for room in rooms.split() if room != "."):
                at = row[3].find(f"`{room}/`")
                here = max(here, at)
                if at < 0:
                    found.append(f"docs/architecture.md: the row of {floor}/ does not name `{room}/`")
                elif at < below:
                    found.append(f"docs/architecture.md: the row of {floor}/ names `{room}/` before a lower room")
            below = here
    return sorted(found)


def all_rooms(source):
    found = check_page((source / "docs/architecture.md").read_text())
    return found, sum(len(rooms.split()) for floor in ROOMS.values() for rooms in floor)


def all_links(folder):
    found, programs = [], 0
    for program in LINKS:
        if (folder / program).exists():
            result = subprocess.run(["ldd", folder / program], capture_output=True, text=True)
            found += check_links(program, result.stdout + result.stderr)
            programs += 1
    return found, programs


def self_test():
    bad_includes = [
        ("system/files/descriptor.h", '#include "pbm_format/law/catalogue.h"'),
        ("system/threads/parallel.h", '#include "system/files/descriptor.h"'),
        ("system/error.h", '#include "system/threads/parallel.h"'),
        ("format_spec/pbm_format/reading/reader.cpp", '#include "pbm_render/camera/camera.h"'),
        ("format_spec/pbm_format/model/octree.cpp", '#include "pbm_format/reading/reader.h"'),
        ("format_spec/pbm_format/model/octree.h", '#include "pbm_format/container/layout.h"'),
        ("format_spec/pbm_format/unknown.h", '#include "pbm_format/hashes/hash.h"'),
        ("format_spec/pbm_format/reading/reader.cpp", '#include "pbm_format/nowhere/reader.h"'),
        ("format_spec/pbm_format/reading/reader.cpp", '#include "system/files/mapped_file.h"'),
        ("format_spec/pbm_format/reading/reader.cpp", "#include <zstd.h>"),
        ("format_spec/pbm_format/reading/reader.cpp", "#include <xxhash.h>"),
        ("format_spec/pbm_format/container/layout.cpp", "#include <nlohmann/json.hpp>"),
        ("format_spec/pbm_format/model/model.h", "#include <glm/vec3.hpp>"),
        ("format_spec/pbm_format/writing/writer.cpp", "#include <unistd.h>"),
        ("tools/pbm_scan/surface_reader.cpp", "#include <sys/mman.h>"),
        ("tools/pbm_scan/ply/ply_reader.cpp", '#include "pbm_scan/mesh/obj_text.h"'),
        ("tools/pbm_scan/text/text_lines.h", '#include "pbm_scan/ply/ply_header.h"'),
        ("runtime/pbm_render/camera/camera.h", '#include "pbm_scan/surface/surface.h"'),
        ("runtime/pbm_render/camera/camera.h", "#  include <pbm_scan/surface/surface.h>"),
        ("runtime/pbm_render/camera/camera.h", '#include "../../tools/pbm_scan/surface/surface.h"'),
        ("runtime/pbm_render/camera/camera.h", '#include "pbm_render/splats/splat.h"'),
        ("runtime/pbm_render/fine/fine_renderer.h", '#include "pbm_render/fast/fast_renderer.h"'),
        ("runtime/pbm_render/reference/reference_renderer.cpp", '#include "pbm_render/tables/splat_blocks.h"'),
        ("runtime/pbm_render/detail/streamed_model.cpp", '#include "system/files/mapped_file.h"'),
        ("runtime/pbm_render/camera/camera.cpp", "#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>"),
        ("runtime/pbm_bake/shadow_map.h", '#include "pbm_render/camera/camera.h"'),
        ("runtime/pbm_render/camera/camera.h", '#include "pbm_bake/shadow_map.h"'),
        ("runtime/pbm_surface/surface_offsets.h", '#include "pbm_render/bricks/point_run.h"'),
        ("runtime/viewer/pbm-render/main.cpp", "#include <GLFW/glfw3.h>"),
        ("runtime/viewer/navigation/camera_control.cpp", "#include <GLFW/glfw3.h>"),
        ("runtime/viewer/pictures/avi_writer.cpp", '#include "viewer/scene/scene.h"'),
        ("runtime/viewer/pbm-view/viewer.cpp", "#include <GLFW/glfw3.h>"),
        ("runtime/viewer/pbm-view/window/window.cpp", "#include <epoxy/gl.h>"),
        ("runtime/viewer/pbm-view/window/window.cpp", "#include <imgui.h>"),
        ("runtime/viewer/pbm-view/window/window.cpp", "#include <backends/imgui_impl_glfw.h>"),
        ("runtime/viewer/pbm-view/window/window.cpp", '#include "pbm_build/pipeline.h"'),
        ("runtime/viewer/pbm-view/window/panel.h", '#include "viewer/pbm-view/drawing/shown.h"'),
        ("runtime/viewer/pbm-render/main.cpp", '#include "viewer/pbm-view/measure/polyline.h"'),
        ("runtime/viewer/pbm-render/png_writer.h", "#include <CLI/CLI.hpp>"),
        ("runtime/viewer/pictures/picture_file.cpp", "#include <isa-l/igzip_lib.h>"),
        ("runtime/viewer/pictures/image_writer.cpp", "#include <png.h>"),
        ("tools/pbm-build/pbm_build/pipeline.cpp", '#include "pbm_render/camera/camera.h"'),
        ("tools/pbm-build/pbm_build/lattice/lattice.h", '#include "pbm_build/voxels/voxelize.h"'),
        ("tools/pbm_scan/surface/surface.h", '#include "pbm_build/pipeline.h"'),
        ("tools/pbm_scan/ply/ply_reader.cpp", "#include <OpenMesh/Core/IO/MeshIO.hh>"),
        ("tools/pbm-validate/main.cpp", '#include "pbm_scan/surface/surface.h"'),
        ("tools/pbm-info/main.cpp", "#include <boost/any.hpp>"),
        ("data/pbm-sample/main.cpp", '#include "pbm_render/camera/camera.h"'),
        ("command_line/command_line.h", '#include "pbm_format/law/catalogue.h"'),
        ("command_line/command_line.cpp", "#include <CLI/CLI.hpp>"),
        ("command_line/parse.h", "#include <CLI/CLI.hpp>"),
        ("tools/pbm-build/options/options.cpp", "#include <toml++/toml.h>"),
        ("runtime/viewer/pbm-render/main.cpp", "#include <CLI/CLI.hpp>"),
        ("runtime/viewer/scene/painter.cpp", "#include <thread>"),
        ("bindings/c/drawing.cpp", '#include "viewer/scene/painter.h"'),
        ("runtime/pbm_render/camera/camera.cpp", '#include "c/boundary.h"'),
        ("elsewhere/main.cpp", "#include <vector>"),
    ]
    good_includes = [
        ("command_line/parse.cpp", "#include <CLI/CLI.hpp>"),
        ("tools/pbm-build/options/recipe.cpp", "#include <toml++/toml.h>"),
        ("format_spec/pbm_format/reading/reader.cpp",
         '#include "pbm_format/reading/reader.h"\n#include "pbm_format/chunks/chunk.h"\n#include <vector>'),
        ("format_spec/pbm_format/reading/reader.cpp", '#include "system/threads/parallel.h"\n#include "system/error.h"'),
        ("format_spec/pbm_format/writing/writer.cpp", '#include "system/files/file_replacement.h"'),
        ("format_spec/pbm_format/streams/frame.cpp", "#include <zstd.h>"),
        ("runtime/viewer/pbm-render/main.cpp",
         '#include "pbm_render/camera/camera.h"\n#include "command_line/parse.h"\n#include "png_writer.h"'),
        ("runtime/viewer/options/view_options.cpp", '#include "command_line/parse.h"'),
        ("runtime/viewer/pictures/image_writer.cpp", "#include <isa-l/igzip_lib.h>"),
        ("runtime/viewer/pbm-view/window/window.cpp", "#include <GLFW/glfw3.h>"),
        ("runtime/viewer/pbm-view/window/presenter.cpp", "#include <epoxy/gl.h>"),
        ("runtime/viewer/pbm-view/window/overlay.cpp", "#include <imgui.h>\n#include <backends/imgui_impl_opengl3.h>"),
        ("tools/pbm-build/pbm_build/mesh_repair/half_edges.cpp", "#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>"),
    ]
    bad_cmake = [
        ("tools/pbm-build/CMakeLists.txt", "target_link_libraries(pbm_build PUBLIC pbm::render)"),
        ("runtime/viewer/CMakeLists.txt", "target_link_libraries(pbm-render PRIVATE pbm_build)"),
        ("format_spec/CMakeLists.txt", "find_package(OpenMesh)"),
        ("bindings/c/CMakeLists.txt", "target_link_libraries(pbm_c PRIVATE pbm_paged_heap)"),
        ("tools/pbm_scan/CMakeLists.txt", "find_package(OpenMesh REQUIRED)"),
        ("tools/pbm_scan/CMakeLists.txt", "target_link_libraries(pbm_scan PUBLIC pbm::writing)"),
        ("data/pbm-sample/CMakeLists.txt", "target_link_libraries(pbm_sample PUBLIC pbm_render)"),
    ]
    bad_folders = [("runtime/pbm_render/splats", MOST_FILES + 1)]
    bad_links = [
        ("pbm-render", "\tlibc.so.6 => /lib/libc.so.6 (0x1)\n\tlibGL.so.1 => /lib/libGL.so.1 (0x1)"),
        ("pbm-render", "\tlibX11.so.6 => /lib/libX11.so.6 (0x1)"),
        ("pbm-render", "\tlibOpenMeshCore.so.9.0 => /lib/libOpenMeshCore.so.9.0 (0x1)"),
        ("pbm-view", "\tlibOpenMeshCore.so.9.0 => /lib/libOpenMeshCore.so.9.0 (0x1)"),
        ("pbm-validate", "\tlibOpenMeshCore.so.9.0 => /lib/libOpenMeshCore.so.9.0 (0x1)"),
        ("pbm-render", "\tlibpng16.so.16 => /lib/libpng16.so.16 (0x1)"),
        ("pbm-info", "\tlibpng16.so.16 => /lib/libpng16.so.16 (0x1)"),
        ("pbm-build", "\tlibglfw.so.3 => /lib/libglfw.so.3 (0x1)"),
        ("pbm-build", "\tlibzstd.so.1 => not found"),
    ]
    wrong = [f"accepted: {case}" for case in bad_includes if not check_includes(*case)]
    wrong += [f"refused: {check_includes(*case)}" for case in good_includes if check_includes(*case)]
    wrong += [f"accepted: {case}" for case in bad_cmake if not check_cmake(*case)]
    wrong += [f"accepted: {case}" for case in bad_links if not check_links(*case)]
    wrong += [f"accepted: {case}" for case in bad_folders if not check_folder(*case)]
    page = "".join(f"| `{floor}/` | |" + "".join(f" `{room}/`" for rooms in ROOMS.get(floor, [])
                   for room in rooms.split()) + " |\n" for floor in FLOORS)
    bad_pages = [page.replace("`splats/` ", ""), page.replace("| `runtime/pbm_bake/` | |", "| other | |"),
                 page.replace("`law/`", "").replace("`writing/`", "`writing/` `law/`")]
    wrong += [f"accepted: page {number}" for number, bad in enumerate(bad_pages) if not check_page(bad)]
    wrong += check_page(page)
    wrong += [f"accepted: {folder}" for folder, most in MOST_LINES.items() if not check_length(folder, most + 1)]
    good = "\tlinux-vdso.so.1 (0x1)\n\tlibzstd.so.1 => /lib/libzstd.so.1 (0x1)"
    wrong += check_links("pbm-render", good)
    return wrong, len(bad_includes) + len(good_includes) + len(bad_cmake) + len(bad_folders) + len(bad_links) + len(bad_pages) + 2


def main():
    modes = {"includes": all_includes, "links": all_links, "rooms": all_rooms, "self-test": self_test}
    if len(sys.argv) < 2 or sys.argv[1] not in modes:
        sys.exit(__doc__)
    found, checked = modes[sys.argv[1]](*map(pathlib.Path, sys.argv[2:]))
    print("\n".join(found + [f"{checked} checked, {len(found)} wrong"]))
    return 1 if found or checked == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
