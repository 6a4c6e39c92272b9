#include "pbm_build/voxels/voxel_sums.h"

#include <glm/geometric.hpp>

namespace pbm::build {
bool VoxelSums::is_thin() const {
    const glm::dvec3 sum(normal[0], normal[1], normal[2]);
    const double half = kNormalScale / 2 * static_cast<double>(votes);
    return glm::dot(sum, sum) < half * half;
}

Rgb8 VoxelSums::mean_colour() const {
    Rgb8 mean;
    for (std::size_t c = 0; c < 3; ++c)
        mean[c] = linear_to_srgb(static_cast<std::uint32_t>((2 * colour[c] + samples) / (2 * std::uint64_t{samples})));
    return mean;
}

std::uint16_t mean_normal(const VoxelSums &sums) {
    if (sums.votes == 0)
        return kNoNormal;
    const bool two_sided = 2 * std::uint64_t{sums.two_sided} >= sums.votes;
    return static_cast<std::uint16_t>(quantise_normal(sums.normal) | (two_sided ? kTwoSidedBit : 0));
}

std::uint16_t plane_normal(const PlaneSums &plane) {
    std::size_t longest = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (plane.columns[k][k] > plane.columns[longest][longest])
            longest = k;
    return quantise_normal(plane.columns[longest]) | kTwoSidedBit;
}

} // namespace pbm::build
