// How the rows of a text table are divided into cells.
#pragma once

#include "system/error.h"

#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

struct CellStyle {
    char separator = ' ';       // ',', ';' or a tab; ' ': white space, of which no cell can be empty
    bool decimal_comma = false; // "1,5" is a number
};

// Finds the style of a table from its first rows. A semicolon separates wherever there is one. A comma is a decimal
// sign beside semicolons, and in rows of three words or more with at most one comma inside each. Tabs separate where
// the header has a name for each cell, or where no cell of the first rows is empty.
//
// errors  bad_input  rows like "1,234.5 2,345.6 3,456.7" or "1,5, 2,5, 3,5"
Result<CellStyle> find_cell_style(std::string_view text);

// The cells of a line of text, without white space and quotes around them.
std::vector<std::string> text_cells(std::string_view line, char separator);

} // namespace pbm::build
