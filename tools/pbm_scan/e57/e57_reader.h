// Reads E57 files, which laser scanners write: clouds of points with the poses of the scanner.
// Format: ASTM E2807-11. Standard Specification for 3D Imaging Data Exchange, Version 1.0
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

bool is_e57(std::span<const std::uint8_t> bytes);

// All scans of the file become one surface, in the coordinates of the file: each scan is moved by its pose. Points
// without a valid position are left out and counted.
//
// The scanner stood at the origin of a scan that is spherical only, or has rows and columns. It also stood there if the
// scan has a pose, and the pose of any scan of the file rotates: poses that only shift are mostly the origin of a map.
// For other scans the position of the scanner is unknown.
//
// errors  bad_input            a page that does not match its checksum, a damaged header, XML section or packet, counts
//                              beyond the size of the file
//         unsupported_feature  another version, another compression
//         too_large            over a limit of e57_xml.h
Result<Surface> read_e57(std::span<const std::uint8_t> bytes, const ReadOptions &options);

} // namespace pbm::build
