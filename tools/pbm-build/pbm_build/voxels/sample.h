// One vote for the attributes of one voxel.
#pragma once

#include "pbm_build/surface/short_normal.h"
#include "pbm_format/model/model.h"
#include "pbm_format/model/point_values.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

namespace pbm::build {

using LinearColour = std::array<std::uint16_t, 3>; // linear light, as in linear_table()

inline LinearColour linear_colour(const Rgb8 &srgb) {
    const std::span<const std::uint16_t> table = linear_table();
    return {table[srgb[0]], table[srgb[1]], table[srgb[2]]};
}

struct Sample {
    ShortNormal normal{}; // zero: no vote
    LinearColour colour{};

    // Attributes common to all samples of a triangle, except for the material and holes.
    struct Rest {
        std::uint8_t material = 0;
        std::uint8_t radius = 0; // index of the radius table; 0: none given
        bool two_sided = false;
        bool is_hole = false; // an image cuts a hole here: no vote for anything

        // Includes one more corner of the triangle.
        void add_corner(const Rest &corner) {
            radius = std::max(radius, corner.radius);
            two_sided |= corner.two_sided;
        }
    };
    Rest rest{};
};

} // namespace pbm::build
