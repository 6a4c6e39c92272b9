// The distinct positions of a cloud of points, in an order that does not depend on that of the file.
#pragma once

#include "pbm_build/lattice/lattice.h"

#include <span>

namespace pbm::build {

// Maximum number of distinct positions kept per lattice point: enough to show that points are dense there, and few
// enough for a fast search.
inline constexpr std::size_t kMaxSharing = 9;

struct DistinctPoints {
    std::vector<LatticePoint> at;        // along the Morton curve
    std::vector<std::uint32_t> place_of; // [positions] index into `at`
    std::uint64_t repeated = 0;          // positions equal to an earlier one
};

// On the lattice of `grid`. At most 2^32 - 1 positions.
DistinctPoints distinct_points(std::span<const glm::dvec3> positions, const Grid &grid, int threads);

} // namespace pbm::build
