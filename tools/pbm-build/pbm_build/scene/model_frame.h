// Place and orientation of a model: the frame in which lights and the ground plane are placed.
#pragma once

#include "pbm_format/model/model.h"

#include <glm/vec3.hpp>

#include <span>

namespace pbm::build {

// Places are in model units from the grid's minimum corner.
struct ModelFrame {
    glm::dvec3 origin{};               // the grid's minimum corner, model coordinates
    glm::dvec3 centre{};               // of the box around the occupied voxels
    double radius = 0;                 // of the sphere around it that holds them all
    double lowest = 0;                 // along `up`
    glm::dvec3 right{}, up{}, front{}; // axes of the default camera, which is in front of the model
    int up_axis = 1;                   // of x, y, z
};

// `codes`: Morton codes of the finest level, at least one.
ModelFrame frame_of(const Grid &grid, std::span<const MortonCode> codes);

} // namespace pbm::build
