// Reads tables of points as text: XYZ, PTS, ASC, CSV, TXT.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// Rows of numbers between spaces, tabs, commas or semicolons; the decimal sign may be a comma where that is no
// separator (cell_style.h). An empty cell between separators is a missing value. Comments begin with '#' or "//".
// Columns are named by the first line that is no number, also behind a comment sign, as CloudCompare writes it. Without
// names they are guessed by their number and content, and the report says so (Warning::guessed_columns): unit vectors
// are normals, whole numbers up to 255 colours, a fourth of four or seven columns intensity. Where all of the last four
// are such whole numbers, they are a colour and an opacity or a label if the last one is constant or below 32, else an
// intensity and a colour (PTS). A first column that counts the rows from 0 or 1 is a number, not x, unless columns 4 to
// 6 are a colour or a normal. A line of one number is a count of the points behind it (PTS).
//
// ReadOptions::columns takes the place of names and guesses.
//
// errors  bad_input  no table; a row of another length; text that is no number; fewer points than a count says;
//                    commas of which it is not clear what they are
//         usage      fewer columns than ReadOptions::columns
//         too_large  more than 2^31 - 1 points
Result<Surface> read_text_cloud(std::span<const std::uint8_t> bytes, const ReadOptions &options);

// Names of columns, "x,y,z,-,label": those of point_table.h, "-" for one to skip, of numbers or text, or any other name
// of a measurement.
//
// errors  usage  no x, y and z; an empty name; two of one name
Result<std::vector<std::string>> parse_columns(const std::string &list);

} // namespace pbm::build
