// The attributes of one voxel from all its samples: integer sums, so that the order of samples does not matter.
#pragma once

#include "pbm_build/voxels/sample.h"
#include "pbm_format/model/streams.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace pbm::build {

// The normal of a voxel without any given normal. fill_normals (splat_radius.h) replaces it.
inline constexpr std::uint16_t kNoNormal = 0xFFFF;

// One cache line.
struct VoxelSums {
    std::array<std::int64_t, 3> normal{};
    std::array<std::uint64_t, 3> colour{};
    std::uint32_t samples = 0;   // of colour
    std::uint32_t votes = 0;     // for the normal
    std::uint32_t two_sided = 0; // of those
    std::uint8_t radius = 0;     // the largest

    void add_normal(const std::array<std::int32_t, 3> &n, bool is_two_sided) {
        const std::uint32_t vote = (n[0] | n[1] | n[2]) == 0 ? 0 : 1;
        votes += vote;
        two_sided += is_two_sided ? vote : 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            normal[axis] += n[axis];
    }
    void add_colour(const std::array<std::int32_t, 3> &linear) {
        ++samples;
        for (std::size_t channel = 0; channel < 3; ++channel)
            colour[channel] += static_cast<std::uint64_t>(linear[channel]);
    }
    void add_rest(const Sample::Rest &rest) { radius = std::max(radius, rest.radius); }

    // Whether the normals cancel to less than half of the votes: a thin wall, which takes the normal of its plane.
    bool is_thin() const;
    // Whether they cancel to less than three quarters: there may be a wall in the voxel.
    bool may_be_wall() const;
    // Whether they cancel to less than 0.98 of the votes: normals differ by more than 20 degrees.
    bool is_bent() const;

    Rgb8 mean_colour() const; // taken in linear light
    // Stores the attributes other than normal, colour and material.
    void store_rest(PointAttributes &points, std::size_t point) const { points.radii[point] = radius; }
};

// The common plane of opposite normals in a thin voxel. columns[k] = sum of n[k] x n, so that all normals point to the
// positive side of axis k; plane_normal takes the column of the largest diagonal element.
struct PlaneSums {
    std::array<std::array<std::int64_t, 3>, 3> columns{};

    void add(const std::array<std::int32_t, 3> &n) {
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t axis = 0; axis < 3; ++axis)
                columns[k][axis] += std::int64_t{n[k]} * n[axis];
    }
    // The normal of the plane, of any length.
    const std::array<std::int64_t, 3> &normal() const;
};

// Whether two groups of samples of a voxel are the two sides of a wall: each faces one way, the two face opposite ways,
// and none is less than an eighth of them.
bool are_sides(const VoxelSums &a, const VoxelSums &b);

// Index | kTwoSidedBit, or kNoNormal. A voxel is two-sided if it is thin, or if at least half of its votes are.
std::uint16_t mean_normal(const VoxelSums &sums);   // of a voxel that is not thin
std::uint16_t plane_normal(const PlaneSums &plane); // of one that is

// Votes per material; the majority wins, ties go to the lowest index.
using MaterialVotes = std::array<std::uint32_t, kMaxMaterials>;
inline std::uint8_t majority(const MaterialVotes &votes) {
    return static_cast<std::uint8_t>(std::max_element(votes.begin(), votes.end()) - votes.begin());
}

} // namespace pbm::build
