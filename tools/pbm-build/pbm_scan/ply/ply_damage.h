// Damage that befell a PLY file as a whole, where its data shows it: a transfer in text mode, a format line that names
// the wrong encoding. The message then says that, instead of what the first misread number looks like.
#pragma once

#include "pbm_scan/ply/ply_roles.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace pbm::build {

// The header says binary and the body is text: its first 64 bytes and more are digits, signs and white space.
std::optional<Error> text_in_binary_body(std::span<const std::uint8_t> bytes, const PlyHeader &header);

// How many bytes a transfer in text mode has inserted: a CR in front of every LF of a binary body. 0: it was none;
// fewer than four such pairs may be chance.
std::size_t inserted_line_ends(std::span<const std::uint8_t> bytes, const PlyHeader &header);
Error inserted_line_ends_error(const PlyHeader &header);

// What to add to the message about a body that cannot be read: a transfer has taken CRs out (there are at most an
// eighth of the pairs CR LF that chance alone would give, where that is 8 or more; or no CR beside 64 LFs), or the body
// of a file that says `ascii` is binary. Empty where the data shows neither. `at`: where reading failed.
std::string body_hint(std::span<const std::uint8_t> bytes, const PlyHeader &header, std::size_t at);

// Coordinates that are absurd (not finite, above 1e32 or below 1e-12 but not zero) in more than a quarter of the
// numbers, while at most a hundredth of them is when read in the other byte order. `positions` as read from a binary
// file; coordinates of whole-number types tell nothing. At most 4,096 vertices, evenly spread, are looked at.
std::optional<Error> wrong_byte_order(std::span<const glm::dvec3> positions, const PlyHeader &header,
                                      const PlyRoles &roles);

// "binary_little_endian" and so on, as format lines have it.
std::string_view to_string(PlyEncoding encoding);
// The other byte order of a binary encoding.
PlyEncoding swapped(PlyEncoding encoding);

} // namespace pbm::build
