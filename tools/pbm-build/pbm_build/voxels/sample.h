// One vote for the attributes of one voxel.
#pragma once

#include "pbm_build/surface/short_normal.h"

#include <array>
#include <cstdint>

namespace pbm::build {

using LinearColour = std::array<std::uint16_t, 3>; // linear light, as in linear_table()

struct Sample {
    ShortNormal normal{}; // zero: no vote
    LinearColour colour{};
    std::uint8_t material = 0;
    std::uint8_t radius = 0; // index of the radius table; 0: none given
    bool two_sided = false;
};

} // namespace pbm::build
