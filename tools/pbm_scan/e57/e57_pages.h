// The pages of an E57 file: each ends with a checksum, which is verified before its bytes are used.
// Format: ASTM E2807-11, sections 7 and 8.1
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <span>

namespace pbm::build {

// Offsets count the file's bytes ("physical"), or only those that are no checksum ("logical").
class E57Pages {
  public:
    // Reads the header. Refers to `file`.
    //
    // errors  bad_input            the header is damaged, or the file is shorter than it says
    //         unsupported_feature  another major version than 1
    static Result<E57Pages> open(std::span<const std::uint8_t> file);

    // Copies the logical bytes from `at` on. Verifies each page when it is first read.
    //
    // errors  bad_input  beyond the end of the file, a page that does not match its checksum
    Status read(std::uint64_t at, std::span<std::uint8_t> out);

    std::uint64_t logical_size() const;
    std::uint64_t physical(std::uint64_t logical) const; // for messages
    // Nothing is at a checksum or beyond the end: logical_size() is returned, where nothing can be read.
    std::uint64_t logical(std::uint64_t physical) const;

    FileRange xml() const { return xml_; } // logical offset and size
    std::uint64_t trailing_bytes() const { return trailing_; }

  private:
    static constexpr std::uint64_t kChecksumBytes = 4;

    Status verify(std::uint64_t page);

    std::span<const std::uint8_t> file_;
    std::uint64_t page_bytes_ = 0;
    std::uint64_t trailing_ = 0; // after the length that the header states
    FileRange xml_;
    Bytes verified_; // [pages] 1: its checksum is correct
};

} // namespace pbm::build
