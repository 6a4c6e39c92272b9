// Reads PTX files: scans as text, a point for each line of sight, as Leica's Cyclone exports them.
// Format: Leica Geosystems, "Leica PTX Format" (technical note)
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

// Whether the text begins with the ten lines of a PTX header.
bool is_ptx(std::span<const std::uint8_t> bytes);

// A file has any number of scans: columns, rows, the scanner's position and axes, a matrix of four rows, then x y z
// [intensity [red green blue]] for each line of sight, column by column. All scans become one surface, moved by their
// matrices; the scanner stood where the matrix moves the origin. Points at 0 0 0 are lines of sight without an echo:
// they are left out and counted. Scans become triangles as scan_grids.h says.
//
// errors  bad_input  text that is no number, a line with too few or too many numbers, lines that are missing, a matrix
//                    that is not affine
//         too_large  more points than 32 bits can number
Result<Surface> read_ptx(std::span<const std::uint8_t> bytes, const ReadOptions &options);

} // namespace pbm::build
