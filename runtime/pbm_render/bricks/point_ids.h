// What a pixel knows of the point that it shows.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pbm {

// Point ids: the highest bit says that the back of the point is seen; below it stand the run's number and, in the low
// bits, the point's index within its chunk.
struct PointIds {
    static constexpr std::uint32_t kBackBit = 1U << 31;
    int point_bits;

    std::size_t max_runs() const { return kBackBit >> point_bits; }
    std::uint32_t first_of(std::size_t run) const { return static_cast<std::uint32_t>(run) << point_bits; }
    static bool is_back(std::uint32_t id) { return (id & kBackBit) != 0; }
    std::size_t run(std::uint32_t id) const { return (id & ~kBackBit) >> point_bits; }
    std::size_t point(std::uint32_t id) const { return id & ((1U << point_bits) - 1); }
};

} // namespace pbm
