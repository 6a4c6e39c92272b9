// Text of other programs in UTF-8: without the byte order mark that some write, and decoded from UTF-16.
#pragma once

#include "system/error.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

struct Utf8Text {
    std::span<const std::uint8_t> bytes;
    std::vector<std::uint8_t> decoded; // holds `bytes` if the file is in UTF-16
    std::uint64_t skipped = 0;         // bytes of the mark

    // The offset in the file of the byte at `at` of `bytes`.
    std::uint64_t offset_in_file(std::uint64_t at) const;
};

// A file without a byte order mark is returned as it is. Refers to `file`.
//
// errors  bad_input  UTF-32; half a character of UTF-16, with its offset
Result<Utf8Text> as_utf8(std::span<const std::uint8_t> file);

void append_utf8(char32_t character, std::string &text);

} // namespace pbm::build
