// File name extensions of the scans that pbm-build reads, for file dialogs and folders. The formats themselves:
// tools/pbm_scan/formats.cpp; a test compares the two. Tables of points named .txt or .csv are read and not
// listed, because most such files are something else.
#pragma once

#include <array>
#include <string_view>

namespace pbm::command_line {

inline constexpr std::array<std::string_view, 17> kScanExtensions{".xyzrgb", ".xyzn", ".ply", ".gltf", ".glb", ".obj",
                                                                  ".stl",    ".off",  ".e57", ".ptx",  ".las", ".laz",
                                                                  ".spz",    ".pcd",  ".xyz", ".pts",  ".asc"};

} // namespace pbm::command_line
