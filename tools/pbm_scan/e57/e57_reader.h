// Reads E57 files, which laser scanners write: clouds of points with the poses of the scanner.
// Format: ASTM E2807-11. Standard Specification for 3D Imaging Data Exchange, Version 1.0
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

bool is_e57(std::span<const std::uint8_t> bytes);

// All scans of the file become one surface, in the coordinates of the file: each scan is moved by its pose. Points
// without a valid position are left out and counted. The scanner stood at the origin of a scan that has spherical
// coordinates, rows and columns, or a pose, if the pose of one of the scans turns it: a pose that only shifts is mostly
// the origin of a map. Of other scans it is not known.
//
// errors  bad_input            a page that does not match its checksum, a damaged header, XML section or packet, counts
//                              beyond the size of the file
//         unsupported_feature  another version, another compression
//         too_large            over a limit of e57_xml.h
Result<Surface> read_e57(std::span<const std::uint8_t> bytes, const ReadOptions &options);

} // namespace pbm::build
