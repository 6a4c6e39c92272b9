// The places of a cloud of points, each once, in an order that does not depend on that of the file: points in one place
// count as one.
#pragma once

#include "pbm_build/grid/lattice.h"

#include <span>

namespace pbm::build {

// Different places that may share a lattice point: enough to say that points are dense there, and so few that a search
// among them stays cheap.
inline constexpr std::size_t kMaxSharing = 9;

struct DistinctPoints {
    std::vector<LatticePoint> at;        // along the Morton curve
    std::vector<std::uint32_t> place_of; // [positions] index into `at`
    std::uint64_t repeated = 0;          // positions that are equal to another one before them
};

// On the lattice of `grid`. At most 2^32 - 1 positions.
DistinctPoints distinct_points(std::span<const glm::dvec3> positions, const Grid &grid, int threads);

} // namespace pbm::build
