// File name extensions of the scans that pbm-build reads, for file dialogs and folders. The formats themselves:
// tools/pbm-build/pbm_scan/formats.cpp, and its user verifies that the two agree.
#pragma once

#include <array>
#include <string_view>

namespace pbm::command_line {

inline constexpr std::array<std::string_view, 8> kScanExtensions{".ply", ".gltf", ".glb", ".obj",
                                                                 ".stl", ".off",  ".e57", ".ptx"};

} // namespace pbm::command_line
