// Where a model lies and which way it faces: what lights and the ground plane are placed by.
#pragma once

#include "pbm_format/model/model.h"

#include <array>
#include <span>

namespace pbm::build {

// Places are in model units from the grid's minimum corner.
struct ModelFrame {
    std::array<double, 3> origin{};               // the grid's minimum corner, model coordinates
    std::array<double, 3> centre{};               // of the box around the occupied voxels
    double radius = 0;                            // of the sphere around it that holds them all
    double lowest = 0;                            // along `up`
    std::array<double, 3> right{}, up{}, front{}; // of the default camera, which stands in front
    std::size_t up_axis = 1;                      // of x, y, z
};

// `codes`: Morton codes of the finest level, at least one.
ModelFrame frame_of(const Grid &grid, std::span<const MortonCode> codes);

} // namespace pbm::build
