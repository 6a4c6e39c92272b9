// Reads tables of points as text: XYZ, PTS, ASC, CSV, TXT.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>

namespace pbm::build {

// Rows of numbers between spaces, tabs, commas or semicolons; beside semicolons the decimal sign may be a comma.
// Comments begin with '#' or "//". Columns are named by the first line that is no number, also behind a comment sign,
// as CloudCompare writes it. Without names they are guessed by their number and content (unit vectors are normals,
// whole numbers up to 255 colours, a fourth of four or seven columns intensity), and the report says so. A line of one
// number is a count of the points behind it (PTS).
//
// errors  bad_input  no table; a row of another length; text that is no number; fewer points than a count says
//         too_large  more than 2^31 - 1 points
Result<Surface> read_text_cloud(std::span<const std::uint8_t> bytes, const ReadOptions &options);

} // namespace pbm::build
