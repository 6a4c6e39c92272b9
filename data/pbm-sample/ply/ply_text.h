// Numbers as the text of an ASCII PLY.
#pragma once

#include "system/bytes.h"

#include <charconv>

namespace pbm::sample {

enum class PlyEncoding { binary_little_endian, ascii };

inline const char *format_name(PlyEncoding encoding) {
    return encoding == PlyEncoding::ascii ? "ascii" : "binary_little_endian";
}

// Appends the shortest decimal that reads back the same, then a space.
template <class Number> void put_text(Bytes &out, Number value) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
    out.insert(out.end(), digits, end);
    out.push_back(' ');
}

} // namespace pbm::sample
