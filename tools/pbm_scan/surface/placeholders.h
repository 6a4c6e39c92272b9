// Points that stand for no measurement: lines of sight without an echo, and values for "no data".
#pragma once

#include "pbm_scan/surface/surface.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

struct Placeholders {
    std::size_t at_zero = 0, at_sentinels = 0;

    std::size_t sum() const { return at_zero + at_sentinels; }
    std::string note() const; // for the report
};

// A test that most points fail.
inline bool may_be_placeholder(const glm::dvec3 &p) {
    const double least = std::min({p.x, p.y, p.z}), most = std::max({p.x, p.y, p.z});
    return (least == 0 && most == 0) || least <= -9999 || most >= 1e10;
}

// Marks [positions] placeholders among the positions from `first` on by 1. Empty where there are none, or fewer than 16
// other points. A point is one if
//   it is 0 0 0, and is farther from the box of the others than its diagonal; or if 16 and 1 of 2,000 or more of the
//   points are there, and 4 times as many as at half of the other places;
//   a coordinate is -9999, -99999, +-1e10 or a limit of single precision, and the point is as far from the others.
std::vector<std::uint8_t> mark_placeholders(std::span<const glm::dvec3> positions, std::size_t first,
                                            Placeholders &found);

} // namespace pbm::build
