#include "pbm_build/grid/lattice.h"

#include "system/threads/parallel.h"

#include <algorithm>

namespace pbm::build {

std::vector<LatticePoint> to_lattice(std::span<const glm::dvec3> positions, const Grid &grid, int threads) {
    constexpr std::size_t kBlock = 65536;
    const double last = static_cast<double>((std::int64_t{1} << (grid.depth + kLatticeBits)) - 1);
    const glm::dvec3 origin = vector_of(grid.origin);
    std::vector<LatticePoint> lattice(positions.size());
    parallel_for(positions.size(), kBlock, threads, [&](std::size_t i) {
        for (int axis = 0; axis < 3; ++axis) {
            const double voxels = (positions[i][axis] - origin[axis]) / grid.voxel_size;
            // Rounds down, since nothing is negative.
            lattice[i][axis] = static_cast<std::int32_t>(std::clamp(voxels * kLatticeSteps + 0.5, 0.0, last));
        }
    });
    return lattice;
}

} // namespace pbm::build
