// The filter "up" of PNG: rows of pixels as differences to the row above.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pbm {

// Writes the differences of `columns` pixels of a row to those of the row above, bytes modulo 256: red, green and blue,
// without alpha. `row`, `above`: R G B A. `to`: 3 x columns bytes, and one byte more that may be written.
void filter_opaque_row(const std::uint8_t *row, const std::uint8_t *above, std::size_t columns, std::uint8_t *to);

} // namespace pbm
