#include "pbm_build/voxels/voxel_sums.h"

#include <glm/geometric.hpp>

namespace pbm::build {
namespace {

constexpr double kMayBeWall = 0.75; // of |sum of normals| over its maximum
constexpr double kBent = 0.98;
constexpr double kOneWay = 0.5;    // the same, of a side
constexpr double kOpposite = -0.5; // cosine between two sides
constexpr std::uint64_t kLeastShare = 8;

glm::dvec3 normal_of(const VoxelSums &sums) { return {sums.normal[0], sums.normal[1], sums.normal[2]}; }

// Whether the normals cancel to less than `share` of the votes.
bool cancel_below(const VoxelSums &sums, double share) {
    const double most = share * kNormalScale * static_cast<double>(sums.votes);
    return glm::dot(normal_of(sums), normal_of(sums)) < most * most;
}

} // namespace

bool VoxelSums::is_thin() const {
    const glm::dvec3 sum(normal[0], normal[1], normal[2]);
    const double half = kNormalScale / 2 * static_cast<double>(votes);
    return glm::dot(sum, sum) < half * half;
}

bool VoxelSums::may_be_wall() const { return cancel_below(*this, kMayBeWall); }
bool VoxelSums::is_bent() const { return cancel_below(*this, kBent); }

bool are_sides(const VoxelSums &a, const VoxelSums &b) {
    const std::uint64_t votes = std::uint64_t{a.votes} + b.votes;
    if (kLeastShare * std::min(a.votes, b.votes) < votes || cancel_below(a, kOneWay) || cancel_below(b, kOneWay))
        return false;
    const glm::dvec3 n = normal_of(a), m = normal_of(b);
    const double along = glm::dot(n, m);
    return along < 0 && along * along > kOpposite * kOpposite * glm::dot(n, n) * glm::dot(m, m);
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

const std::array<std::int64_t, 3> &PlaneSums::normal() const {
    std::size_t longest = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (columns[k][k] > columns[longest][longest])
            longest = k;
    return columns[longest];
}

std::uint16_t plane_normal(const PlaneSums &plane) { return quantise_normal(plane.normal()) | kTwoSidedBit; }

} // namespace pbm::build
