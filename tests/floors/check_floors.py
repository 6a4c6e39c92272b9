#!/usr/bin/env python3
"""Includes go down only, every third-party library has one home, programs link what their floor may.

  check_floors.py includes SOURCE_FOLDER     every file of ours
  check_floors.py links PROGRAM_FOLDER       every program there that has a rule
  check_floors.py self-test                  feeds each rule something that breaks it
"""

import pathlib
import re
import subprocess
import sys

# Which of our folders a folder may include; a file may always include its neighbours by bare name.
FLOORS = {
    "format_spec/pbm_format": {"pbm_format"},
    "runtime/pbm_bake": {"pbm_format", "pbm_bake"},
    "runtime/pbm_render": {"pbm_format", "pbm_bake", "pbm_render"},
    "runtime/viewer": {"pbm_format", "pbm_bake", "pbm_render", "viewer", "command_line"},
    "tools/pbm-build/pbm_scan": {"pbm_format", "pbm_scan"},
    "tools/pbm-build/pbm_build": {"pbm_format", "pbm_bake", "pbm_scan", "pbm_build"},
    "tools/pbm-build": {"pbm_format", "pbm_bake", "pbm_scan", "pbm_build", "command_line"},
    "command_line": {"pbm_format", "command_line"},
    "tools/pbm-validate": {"pbm_format", "command_line"},
    "tools/pbm-info": {"pbm_format", "command_line"},
    "tools/pbm-export": {"pbm_format", "command_line"},
    "data/pbm-sample": {"pbm_format", "command_line"},
}

# Layers of pbm_format, lowest first: a file includes its own header and lower layers.
FORMAT_LAYERS = [
    {"error"},
    {"catalogue"},
    {"bytes"},
    {"byte_lanes", "hash_ways", "normal", "octree", "chunk_rule", "parallel", "per_thread", "descriptor"},
    {"hash"},
    {"platform", "child_process", "child_program"},
    {"point_attributes", "mask_ranks"},
    {"image"},
    {"model", "detail_levels"},
    {"stream_filter", "texel_filter"},
    {"sibling_layout"},
    {"unfilter"},
    {"content_id"},
    {"layout", "sections", "directory", "metadata"},
    {"normal_cone"},
    {"frame", "stream_rules", "brick_index"},
    {"chunk"},
    {"mapped_chunk", "image_section"},
    {"tiled_image", "file_rules", "advice"},
    {"reader"},
    {"writer", "validate"},
]
# Files that implement a part of another file's header, and the one file that hashes what a higher layer lays out.
FORMAT_EXCEPTIONS = {
    ("chunk_rule.cpp", "octree"),
    ("detail_levels.cpp", "model"),
    ("detail_levels.cpp", "parallel"),
    ("sections.cpp", "layout"),
    ("directory.cpp", "layout"),
    ("metadata.cpp", "layout"),
    ("content_id.cpp", "layout"),
}

# Third-party header -> the files that may include it; the first pattern that matches decides.
HOMES = {
    r"zstd.*\.h": r"format_spec/pbm_format/frame\.cpp",
    r"xxh.*\.h": r"format_spec/pbm_format/hash(_avx2|_avx512)?\.cpp",
    r"nlohmann/.*": r"format_spec/pbm_format/metadata\.cpp|tools/.*\.cpp|runtime/viewer/.*\.cpp",
    r"glm/.*": r"(runtime|tools)/.*",
    # In the builder only what runs once per sample: vectors elsewhere are the compiler's.
    r"hwy/.*": (
        r"(format_spec/pbm_format|runtime/pbm_render|runtime/pbm_bake)/.*\.(cpp|h)"
        r"|tools/pbm-build/pbm_build/(noise|short_normal|triangle_columns|triangle_mix)\.cpp"
    ),
    r"OpenMesh/.*": r"tools/pbm-build/pbm_scan/mesh_reader\.cpp",
    r"CLI/.*": r"command_line/parse\.cpp",  # takes seconds to compile
    r"toml\+\+/.*": r"tools/pbm-build/recipe\.cpp",
    r"GLFW/.*": r"runtime/viewer/pbm-view/window\.cpp",
    r"(GL|epoxy)/.*": r"runtime/viewer/pbm-view/presenter\.cpp",
    r"(backends/)?imgui.*": r"runtime/viewer/pbm-view/(overlay|panel)\.cpp",
    r"isa-l/.*|zlib\.h": r"runtime/viewer/image_writer\.cpp",
    r"jpeglib\.h": r"tools/pbm-build/pbm_build/image_decoder\.cpp|runtime/viewer/jpeg_encoder\.cpp",
    r"png\.h|stb/.*": r"tools/pbm-build/pbm_build/image_decoder\.cpp",
    r"sys/mman\.h": r"format_spec/pbm_format/(platform|child_program)\.cpp",
    r"malloc\.h": r"format_spec/pbm_format/platform\.cpp",
    r"sys/resource\.h": r"format_spec/pbm_format/(platform|child_process)\.cpp",
    r"sys/(prctl|syscall|wait)\.h|(spawn|poll|signal)\.h": r"format_spec/pbm_format/child_(process|program)\.cpp",
    r"pthread\.h": r"format_spec/pbm_format/per_thread\.h",
    r"(fcntl|unistd)\.h|sys/.*": (
        r"format_spec/pbm_format/(platform|child_process|child_program|descriptor)\.cpp"
        r"|command_line/progress_display\.cpp"
    ),
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
    "format_spec": r"pbm[_:]+(render|build|scan|bake)\b|glm|OpenMesh|glfw|CLI11",
    "command_line": r"pbm[_:]+(render|build|scan|bake)\b|OpenMesh|glfw",
    "runtime": r"pbm[_:]+(build|scan|sample)\b|OpenMesh|embree",
    "tools": r"pbm[_:]+render\b|glfw|embree",
    "data": r"pbm[_:]+(render|build|scan)\b",
}


def layer_of(stem):
    for rank, layer in enumerate(FORMAT_LAYERS):
        if stem in layer:
            return rank
    return None


def check_format_order(path, included):
    name, stem = path.split("/")[-1], pathlib.PurePath(path).stem
    mine, other = layer_of(stem), layer_of(pathlib.PurePath(included).stem)
    if mine is None or other is None:
        missing = stem if mine is None else included
        return f"{path}: '{missing}' has no layer in FORMAT_LAYERS"
    own = pathlib.PurePath(included).stem
    if own == stem or other < mine or (name, own) in FORMAT_EXCEPTIONS:
        return None
    return f"{path}: includes {included}, which is not below it"


def check_includes(path, text):
    """Violations of one file; `path` is relative to the source folder."""
    found = []
    floor = next((f for f in FLOORS if path.startswith(f + "/")), None)
    if floor is None:
        return [f"{path}: lies in no folder of FLOORS"]
    for line in re.findall(r'^\s*#\s*include\s*([<"][^>"]+[>"])', text, re.MULTILINE):
        header = line[1:-1]
        top = header.split("/")[0]
        if header.startswith(".."):
            found.append(f"{path}: includes {header} by way of the parent folder")
        elif line[0] == '"' or top.startswith("pbm_"):
            if "/" in header and top not in FLOORS[floor]:
                found.append(f"{path}: includes {header}; {floor} may include {sorted(FLOORS[floor]) or 'none of us'}")
            elif top == "pbm_format" and floor == "format_spec/pbm_format":
                problem = check_format_order(path, header)
                if problem:
                    found.append(problem)
        elif not C_HEADERS.fullmatch(header):
            home = next((home for pattern, home in HOMES.items() if re.fullmatch(pattern, header)), None)
            if home is None:
                found.append(f"{path}: <{header}> has no home in HOMES")
            elif not re.fullmatch(home, path):
                found.append(f"{path}: <{header}> belongs in {home}")
    return found


def check_cmake(path, text):
    floor = path.split("/")[0]
    text = re.sub(r"#.*", "", text)
    match = re.search(CMAKE[floor], text) if floor in CMAKE else None
    return [f"{path}: names {match[0]}"] if match else []


def check_links(program, libraries):
    """`libraries`: what ldd prints."""
    if "not found" in libraries:
        return [f"{program}: a library is missing: {libraries}"]
    needed = re.findall(r"^\s*(\S+)", libraries, re.MULTILINE)
    return [f"{program}: needs {name}" for name in needed if re.match(LINKS[program], name)]


def all_includes(source):
    found, files = [], 0
    for top in ("format_spec", "command_line", "runtime", "tools", "data"):
        for file in sorted((source / top).rglob("*")):
            path = file.relative_to(source).as_posix()
            if file.suffix in (".h", ".cpp"):
                found += check_includes(path, file.read_text())
                files += 1
            elif file.name == "CMakeLists.txt":
                found += check_cmake(path, file.read_text())
                files += 1
    for top in ("tests", "bench", "examples"):
        for file in (source / top).rglob("*.cpp"):
            if "#include <CLI/" in file.read_text():
                found.append(f"{file.relative_to(source)}: <CLI/...> belongs in command_line/parse.cpp")
            files += 1
    return found, files


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
        ("format_spec/pbm_format/reader.cpp", '#include "pbm_render/camera.h"'),
        ("format_spec/pbm_format/octree.cpp", '#include "pbm_format/reader.h"'),
        ("format_spec/pbm_format/octree.h", '#include "pbm_format/hash.h"'),
        ("format_spec/pbm_format/unknown.h", '#include "pbm_format/hash.h"'),
        ("format_spec/pbm_format/reader.cpp", "#include <zstd.h>"),
        ("format_spec/pbm_format/reader.cpp", "#include <xxhash.h>"),
        ("format_spec/pbm_format/layout.cpp", "#include <nlohmann/json.hpp>"),
        ("format_spec/pbm_format/model.h", "#include <glm/vec3.hpp>"),
        ("format_spec/pbm_format/writer.cpp", "#include <unistd.h>"),
        ("tools/pbm-build/pbm_scan/surface_reader.cpp", "#include <sys/mman.h>"),
        ("runtime/pbm_render/camera.h", '#include "pbm_scan/surface.h"'),
        ("runtime/pbm_render/camera.h", "#  include <pbm_scan/surface.h>"),
        ("runtime/pbm_render/camera.h", '#include "../../tools/pbm-build/pbm_scan/surface.h"'),
        ("runtime/pbm_render/camera.cpp", "#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>"),
        ("runtime/pbm_bake/shadow_map.h", '#include "pbm_render/camera.h"'),
        ("runtime/viewer/pbm-render/main.cpp", "#include <GLFW/glfw3.h>"),
        ("runtime/viewer/camera_control.cpp", "#include <GLFW/glfw3.h>"),
        ("runtime/viewer/pbm-view/viewer.cpp", "#include <GLFW/glfw3.h>"),
        ("runtime/viewer/pbm-view/window.cpp", "#include <epoxy/gl.h>"),
        ("runtime/viewer/pbm-view/window.cpp", "#include <imgui.h>"),
        ("runtime/viewer/pbm-view/window.cpp", "#include <backends/imgui_impl_glfw.h>"),
        ("runtime/viewer/pbm-view/window.cpp", '#include "pbm_build/pipeline.h"'),
        ("runtime/viewer/pbm-render/png_writer.h", "#include <CLI/CLI.hpp>"),
        ("runtime/viewer/picture_file.cpp", "#include <isa-l/igzip_lib.h>"),
        ("runtime/viewer/image_writer.cpp", "#include <png.h>"),
        ("tools/pbm-build/pbm_build/pipeline.cpp", '#include "pbm_render/camera.h"'),
        ("tools/pbm-build/pbm_scan/surface.h", '#include "pbm_build/pipeline.h"'),
        ("tools/pbm-build/pbm_scan/ply_reader.cpp", "#include <OpenMesh/Core/IO/MeshIO.hh>"),
        ("tools/pbm-validate/main.cpp", '#include "pbm_scan/surface.h"'),
        ("tools/pbm-info/main.cpp", "#include <boost/any.hpp>"),
        ("data/pbm-sample/main.cpp", '#include "pbm_render/camera.h"'),
        ("command_line/command_line.h", '#include "pbm_render/camera.h"'),
        ("command_line/command_line.cpp", "#include <CLI/CLI.hpp>"),
        ("command_line/parse.h", "#include <CLI/CLI.hpp>"),
        ("tools/pbm-build/options.cpp", "#include <toml++/toml.h>"),
        ("runtime/viewer/pbm-render/main.cpp", "#include <CLI/CLI.hpp>"),
        ("elsewhere/main.cpp", "#include <vector>"),
    ]
    good_includes = [
        ("command_line/parse.cpp", "#include <CLI/CLI.hpp>"),
        ("tools/pbm-build/recipe.cpp", "#include <toml++/toml.h>"),
        ("format_spec/pbm_format/reader.cpp", '#include "pbm_format/reader.h"\n#include "pbm_format/chunk.h"\n#include <vector>'),
        ("format_spec/pbm_format/frame.cpp", "#include <zstd.h>"),
        ("runtime/viewer/pbm-render/main.cpp", '#include "pbm_render/camera.h"\n#include "command_line/parse.h"\n#include "png_writer.h"'),
        ("runtime/viewer/view_options.cpp", '#include "command_line/parse.h"'),
        ("runtime/viewer/image_writer.cpp", "#include <isa-l/igzip_lib.h>\n#include <zlib.h>"),
        ("runtime/viewer/pbm-view/window.cpp", "#include <GLFW/glfw3.h>"),
        ("runtime/viewer/pbm-view/presenter.cpp", "#include <epoxy/gl.h>"),
        ("runtime/viewer/pbm-view/overlay.cpp", "#include <imgui.h>\n#include <backends/imgui_impl_opengl3.h>"),
        ("tools/pbm-build/pbm_scan/mesh_reader.cpp", "#include <OpenMesh/Core/IO/importer/BaseImporter.hh>"),
    ]
    bad_cmake = [
        ("tools/pbm-build/CMakeLists.txt", "target_link_libraries(pbm_build PUBLIC pbm::render)"),
        ("runtime/viewer/CMakeLists.txt", "target_link_libraries(pbm-render PRIVATE pbm_build)"),
        ("format_spec/CMakeLists.txt", "find_package(OpenMesh)"),
        ("data/pbm-sample/CMakeLists.txt", "target_link_libraries(pbm_sample PUBLIC pbm_render)"),
    ]
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
    good = "\tlinux-vdso.so.1 (0x1)\n\tlibzstd.so.1 => /lib/libzstd.so.1 (0x1)"
    wrong += check_links("pbm-render", good)
    return wrong, len(bad_includes) + len(good_includes) + len(bad_cmake) + len(bad_links) + 1


def main():
    modes = {"includes": all_includes, "links": all_links, "self-test": self_test}
    if len(sys.argv) < 2 or sys.argv[1] not in modes:
        sys.exit(__doc__)
    found, checked = modes[sys.argv[1]](*map(pathlib.Path, sys.argv[2:]))
    print("\n".join(found + [f"{checked} checked, {len(found)} wrong"]))
    return 1 if found or checked == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
