#include "pbm_build/splat_radius.h"

#include "pbm_build/neighbours.h"
#include "pbm_format/parallel.h"

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 4096;
constexpr int kClassStep = 4;
constexpr std::size_t kRing = 8;         // neighbours that a splat reaches
constexpr double kStray = 3;             // times the median radius
constexpr std::size_t kNormalVotes = 16; // neighbours that lend a normal
constexpr double kMostVoxels = 2;        // radius of dense samples

} // namespace

std::uint8_t dense_radius(int depth) {
    return static_cast<std::uint8_t>(std::min<int>(kMaxFinestRadius, 255 - 12 * depth - 2));
}

std::uint8_t radius_class(std::uint8_t index, int depth) {
    const int dense = dense_radius(depth);
    const int steps = std::max(0, index - dense + kClassStep - 1) / kClassStep;
    return static_cast<std::uint8_t>(std::min<int>(kMaxFinestRadius, dense + kClassStep * steps));
}

Bytes given_radii(const Surface &surface, const Grid &grid) {
    const std::size_t first_point = surface.first_point();
    const bool mixed = first_point > 0 && first_point < surface.positions.size();
    if (surface.radii.empty() && !mixed)
        return {};
    Bytes radii;
    radii.reserve(surface.positions.size());
    const double most_of_triangle = kMostVoxels / static_cast<double>(std::uint64_t{1} << grid.depth);
    for (std::size_t i = 0; i < surface.positions.size(); ++i) {
        const double given = surface.radii.empty() ? 0 : static_cast<double>(surface.radii[i]);
        const bool point = i >= first_point;
        radii.push_back(
            point && !(given > 0)
                ? std::uint8_t{0}
                : radius_class(radius_index(std::min(given / grid.edge(), point ? 1 : most_of_triangle)), grid.depth));
    }
    return radii;
}

void radii_from_neighbours(Voxels &voxels, int depth, int threads) {
    std::vector<std::size_t> missing;
    for (std::size_t i = 0; i < voxels.points.radii.size(); ++i)
        if (voxels.points.radii[i] == 0)
            missing.push_back(i);
    if (missing.empty())
        return;
    const std::size_t count = missing.size();
    const double edge = static_cast<double>(std::uint64_t{1} << depth); // in voxels
    const VoxelNeighbours neighbours(voxels.codes);
    std::vector<float> reach(count, 0); // squared, in voxels
    parallel_for((count + kBlock - 1) / kBlock, threads, [&](std::size_t block) {
        std::array<Neighbour, kRing> found;
        for (std::size_t i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i)
            if (const std::size_t near = neighbours.nearest(missing[i], found); near > 0)
                reach[i] = found[near - 1].squared_distance;
    });
    std::vector<float> sorted = reach;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double most = kStray * std::sqrt(static_cast<double>(*middle));
    for (std::size_t i = 0; i < count; ++i)
        voxels.points.radii[missing[i]] =
            radius_class(radius_index(std::min(std::sqrt(static_cast<double>(reach[i])), most) / edge), depth);
}

void fill_normals(Voxels &voxels, int threads) {
    std::vector<std::uint16_t> &normals = voxels.points.normals;
    std::vector<std::size_t> missing;
    for (std::size_t i = 0; i < normals.size(); ++i)
        if (normals[i] == kNoNormal)
            missing.push_back(i);
    if (missing.empty())
        return;
    const VoxelNeighbours neighbours(voxels.codes);
    const auto table = integer_normal_table();
    std::vector<std::uint16_t> filled(missing.size());
    parallel_for(missing.size(), threads, [&](std::size_t m) {
        std::array<Neighbour, kNormalVotes> found;
        const std::size_t near = neighbours.nearest(missing[m], found);
        std::array<std::int64_t, 3> sum{};
        for (std::size_t k = 0; k < near; ++k)
            if (const std::uint16_t normal = normals[found[k].voxel]; normal != kNoNormal)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    sum[axis] += table[normal & kNormalIndexMask][axis];
        filled[m] = sum == std::array<std::int64_t, 3>{}
                        ? static_cast<std::uint16_t>(quantise_normal(0, 0, 1) | kTwoSidedBit)
                        : quantise_normal(static_cast<double>(sum[0]), static_cast<double>(sum[1]),
                                          static_cast<double>(sum[2]));
    });
    for (std::size_t m = 0; m < missing.size(); ++m)
        normals[missing[m]] = filled[m];
}

} // namespace pbm::build
