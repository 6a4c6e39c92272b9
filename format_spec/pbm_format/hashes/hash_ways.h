// The implementations of XXH3, one per vector width: hash64 selects one, tests compare them.
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

// The widest first; the last one runs on every processor.
std::span<const HashWay> hash_ways();

} // namespace pbm
