// Fixed-point coordinates in a grid. Integer arithmetic makes voxelization independent of the order of a triangle's
// corners, and gives a face within a rounding error of a voxel boundary one layer of voxels.
#pragma once

#include "pbm_format/model/model.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm::build {

// A lattice step is 2^-14 of the finest voxel: 30 bits at depth 16, so products of differences fit 64 bits.
inline constexpr int kLatticeBits = 14;
inline constexpr double kLatticeSteps = 1 << kLatticeBits; // per voxel

// Units of 2^-kLatticeBits voxels from the grid's origin; 0 <= each < 2^(depth + kLatticeBits).
using LatticePoint = glm::ivec3;

// The nearest lattice point of a position, clamped to the grid. Positions are finite, in model units.
class Lattice {
  public:
    explicit Lattice(const Grid &grid);
    LatticePoint operator()(const glm::dvec3 &position) const {
        LatticePoint at;
        for (int axis = 0; axis < 3; ++axis) // rounds down, since nothing is negative
            at[axis] = static_cast<std::int32_t>(
                std::clamp((position[axis] - origin_[axis]) / voxel_size_ * kLatticeSteps + 0.5, 0.0, last_));
        return at;
    }

  private:
    glm::dvec3 origin_;
    double voxel_size_, last_;
};
std::vector<LatticePoint> to_lattice(std::span<const glm::dvec3> positions, const Grid &grid, int threads);

inline glm::dvec3 vector_of(const std::array<double, 3> &v) { return {v[0], v[1], v[2]}; }

// The finest voxel that contains a lattice point; a voxel contains its lower faces.
inline glm::ivec3 voxel_of(const LatticePoint &p) {
    return {p.x >> kLatticeBits, p.y >> kLatticeBits, p.z >> kLatticeBits};
}
inline MortonCode code_of(const glm::ivec3 &voxel) {
    return morton_encode(static_cast<std::uint32_t>(voxel.x), static_cast<std::uint32_t>(voxel.y),
                         static_cast<std::uint32_t>(voxel.z));
}

} // namespace pbm::build
