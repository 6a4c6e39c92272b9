// The ways to XXH3, one for each width of vectors: what hash64 takes its own from, and what tests compare.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace pbm {

struct HashWay {
    std::string_view name;
    std::uint64_t (*hash)(const std::uint8_t *bytes, std::size_t size);
    bool supported; // by this processor
};

// The widest first; the last is for every processor.
std::span<const HashWay> hash_ways();

} // namespace pbm
