// The dialect of a text table: which character separates cells, and which one is the decimal sign.
#pragma once

#include "system/error.h"

#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {

struct CellStyle {
    char separator = ' ';       // ',', ';', a tab, or ' ' for any run of white space, between which no cell is empty
    bool decimal_comma = false; // if set, "1,5" is a number and "1.5" is not
};

// Finds the style of a table from its first rows and from the rows around its first comma:
//
//   semicolon  If a row has one, semicolons separate cells.
//   comma      It is the decimal sign beside semicolons, and if rows have three words or more with at most one comma
//              inside each word. Otherwise commas separate cells.
//   tab        Tabs separate cells if the header has a name for each cell, or if the empty cells vary between rows.
//              (Several tabs that only align columns leave the same cells empty in every row.)
//
// errors  bad_input  the rows can be read in two ways: "1,234.5 2,345.6 3,456.7", "1,5, 2,5, 3,5", "1.200;567,5;8,5"
Result<CellStyle> find_cell_style(std::string_view text);

// A cell of a line.
struct Cell {
    std::string_view text;  // without the white space and the quotes around it
    bool is_quoted = false; // the cell stands in quotes, so that separators in it are part of its text
    bool is_last = true;    // the line has no further cell
};

// Removes the first cell from `line` and returns it. If the separator is ' ', `line` must not begin with white space.
Cell take_cell(std::string_view &line, char separator);

// The texts of all cells of a line.
std::vector<std::string> text_cells(std::string_view line, char separator);

// Whether the text begins a comment: with "#" or "//". An error value of a spreadsheet ("#DIV/0!") begins none.
bool is_comment(std::string_view text);
// Whether a word may be an error value that a spreadsheet writes, in any language: "#NV", "#####".
bool is_error_value(std::string_view word);
// The line without a comment at its end. The comment must follow white space that separates no cells, and must not
// stand in quotes.
std::string_view without_comment(std::string_view line, char separator);

} // namespace pbm::build
