// Detects damage of a PLY file as a whole: a transfer in text mode, a format line with the wrong encoding. The error
// then names the cause instead of the first misread number.
#pragma once

#include "pbm_scan/ply/ply_roles.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace pbm::build {

// The header says binary, but at least the first 64 bytes of the body are digits, signs and white space.
std::optional<Error> text_in_binary_body(std::span<const std::uint8_t> bytes, const PlyHeader &header);

// The number of bytes inserted by a transfer in text mode: a CR before every LF of a binary body. 0: none, or fewer
// than four, which may be chance.
std::size_t inserted_line_ends(std::span<const std::uint8_t> bytes, const PlyHeader &header);
Error inserted_line_ends_error(const PlyHeader &header);

// A hint for the error about an unreadable body: a transfer removed CRs (at most an eighth of the expected random pairs
// CR LF, where at least 8 are expected; or no CR beside 64 LFs), or the body of an `ascii` file is binary. Empty if
// neither applies. `at`: offset of the error.
std::string body_hint(std::span<const std::uint8_t> bytes, const PlyHeader &header, std::size_t at);

// More than a quarter of the coordinates are absurd (not finite, above 1e32, or below 1e-12 but not zero), and at most
// a hundredth in the other byte order. `positions` as read from a binary file; integer coordinates are ignored.
// Examines at most 4,096 evenly spaced vertices.
std::optional<Error> wrong_byte_order(std::span<const glm::dvec3> positions, const PlyHeader &header,
                                      const PlyRoles &roles);

// As in a format line: "binary_little_endian".
std::string_view to_string(PlyEncoding encoding);

} // namespace pbm::build
