// Why depths differ from those of rays by more than a voxel.
#pragma once

#include "fidelity.h"

#include <cstdint>
#include <string>

namespace pbm {

// Counts of interior pixels (fidelity.h). A pixel that misses counts for the first cause that applies.
struct DepthMisses {
    std::uint64_t pixels = 0;
    std::uint64_t within_two = 0; // error of at most two voxels: what a finer level is judged by at this level's voxels
    std::uint64_t grazing = 0;    // the ray meets the triangle at more than 75 degrees
    std::uint64_t contours = 0;   // hits within 2 pixels differ by more than 4 voxels, and the depth lies between them
    std::uint64_t outgrown = 0;   // those of them whose depth is too near
    std::uint64_t thin = 0;       // the ray leaves the mesh again within 2 voxels
    std::uint64_t relief = 0;     // normals within half a voxel of the hit differ by more than 30 degrees
    std::uint64_t others = 0;

    std::uint64_t all() const { return grazing + contours + thin + relief + others; }
};

// `truth` holds the rays of `camera`.
void add_depth_misses(const RayCaster &rays, const Camera &camera, const PictureTruth &truth,
                      const DrawnPicture &drawing, DepthMisses &to);

std::string to_text(const DepthMisses &misses);

} // namespace pbm
