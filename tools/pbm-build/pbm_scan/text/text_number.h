// Numbers in text files: decimal point, optional exponent and sign, `inf` and `nan`; no locale, no allocation.
#pragma once

#include <string>

namespace pbm::build {

// White space of the text formats (PLY, OBJ, OFF, STL).
inline bool ends_word(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// Reads the number that begins at `first` and must end at white space or `last`. The result is correctly rounded; what
// is too large for a double is infinite, what is too small is zero. Returns its end, or null where there is no number.
const char *parse_number(const char *first, const char *last, double &value);

// For messages: whole numbers without decimals.
std::string number_text(double value);

} // namespace pbm::build
