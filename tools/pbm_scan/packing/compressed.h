// Scans that are compressed as a whole, by gzip or zstd.
#pragma once

#include "system/error.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace pbm::build {

// Limit of the unpacked bytes: max(kMaxUnpackedFactor * compressed bytes, kMinUnpackedLimit). Text of scans is 3 to 10
// times as large as its compressed bytes.
inline constexpr std::uint64_t kMaxUnpackedFactor = 200, kMinUnpackedLimit = std::uint64_t{64} << 20;

// The unpacked bytes of a file that begins with the magic number of gzip or zstd (one or more members or frames);
// nothing for another file. `max_bytes`: a further limit.
//
// errors  bad_input  damaged, cut short, or bytes after the end
//         memory     more than the limits
std::optional<Result<std::vector<std::uint8_t>>> unpacked(std::span<const std::uint8_t> file, std::uint64_t max_bytes);

} // namespace pbm::build
