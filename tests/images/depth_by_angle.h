// Depth errors against rays, by viewing angle.
#pragma once

#include "fidelity.h"

#include <array>
#include <cstdint>
#include <string>

namespace pbm {

// Counts interior pixels (fidelity.h) that are drawn and are not see-through.
struct DepthErrors {
    std::uint64_t pixels = 0;
    std::uint64_t deep = 0;      // error of at most one voxel
    std::uint64_t in_front = 0;  // more than one voxel too near
    double sum = 0, squared = 0; // of drawn depth - depth of the ray, voxels
    double across = 0;           // sum of squared errors along the normal, voxels^2
};

// Index: cosine between the ray and the normal of the hit triangle, in steps of 0.1.
using DepthByAngle = std::array<DepthErrors, 10>;

void add_depth_errors(const PictureTruth &truth, const DrawnPicture &drawing, DepthByAngle &to);

std::string to_text(const DepthByAngle &errors);

} // namespace pbm
