// Looks for damage in all of a model, whether pictures show it or not.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <stop_token>
#include <vector>

namespace pbm {

// Larger files are not searched: reading them takes seconds, and evicts the files of others from the system's memory.
inline constexpr std::uint64_t kMaxSearchedBytes = std::uint64_t{1} << 30;
inline constexpr std::size_t kMaxDamageFound = 10; // faults; the search ends there

// Reads the whole file once and verifies the hashes of its sections and of its chunks. Any change of a byte that a
// reader would use breaks one of them. Decodes nothing. Stops between two chunks.
std::vector<Error> find_damage(ByteView file, const std::stop_token &stop);

} // namespace pbm
