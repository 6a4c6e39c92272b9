// How the rows of a text table are divided into cells.
#pragma once

#include "system/error.h"

#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

struct CellStyle {
    char separator = ' ';       // ',', ';' or a tab; ' ': white space, of which no cell can be empty
    bool decimal_comma = false; // "1,5" is a number, and "1.5" is none
};

// Finds the style of a table from its first rows, and from those around its first comma. A semicolon separates wherever
// there is one. A comma is a decimal sign beside semicolons, and in rows of three words or more with at most one comma
// inside each. Tabs separate where the header has a name for each cell, or where not every row has the same empty
// cells, as columns that several tabs align have.
//
// errors  bad_input  rows like "1,234.5 2,345.6 3,456.7", "1,5, 2,5, 3,5" or "1.200;567,5;8,5"
Result<CellStyle> find_cell_style(std::string_view text);

// A cell of a line.
struct Cell {
    std::string_view text;  // without white space and quotes around it
    bool is_quoted = false; // its quotes hold separators together
    bool is_last = true;    // of the line
};

// Takes the first cell off `line`. Between white space the line must begin with the cell's text.
Cell take_cell(std::string_view &line, char separator);

std::vector<std::string> text_cells(std::string_view line, char separator);

// Whether a comment begins with this text: "#" or "//", but not an error value of a spreadsheet ("#DIV/0!").
bool is_comment(std::string_view text);
// Whether a word can be an error value of a spreadsheet in any language: "#NV", "#####".
bool is_error_value(std::string_view word);
// The line without the comment that may end it, which begins behind white space that is no separator, and in no quotes.
std::string_view without_comment(std::string_view line, char separator);

} // namespace pbm::build
