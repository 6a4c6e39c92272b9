// How far depths are from those of rays, by the angle under which the surface is seen.
#pragma once

#include "fidelity.h"

#include <array>
#include <cstdint>
#include <string>

namespace pbm {

// Interior pixels (fidelity.h) that are drawn and not to be seen through.
struct DepthErrors {
    std::uint64_t pixels = 0;
    std::uint64_t deep = 0;      // at most a voxel off
    std::uint64_t in_front = 0;  // more than a voxel nearer
    double sum = 0, squared = 0; // of drawn - ray's depth, voxels
    double across = 0;           // sum of squares of what is off along the normal, voxels
};

// By the cosine between the ray and the normal of the triangle that it hits: 0 .. 0.1, 0.1 .. 0.2 and so on.
using DepthByAngle = std::array<DepthErrors, 10>;

void add_depth_errors(const RayImage &rays, const Drawing &drawing, DepthByAngle &to);

std::string to_text(const DepthByAngle &errors);

} // namespace pbm
