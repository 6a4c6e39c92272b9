#include "pbm_build/lattice/lattice.h"

#include "system/threads/parallel.h"

namespace pbm::build {

Lattice::Lattice(const Grid &grid)
    : origin_(vector_of(grid.origin)), voxel_size_(grid.voxel_size),
      last_(static_cast<double>((std::int64_t{1} << (grid.depth + kLatticeBits)) - 1)) {}

std::vector<LatticePoint> to_lattice(std::span<const glm::dvec3> positions, const Grid &grid, int threads) {
    constexpr std::size_t kBlock = 65536;
    const Lattice lattice(grid);
    std::vector<LatticePoint> points(positions.size());
    parallel_for(positions.size(), kBlock, threads, [&](std::size_t i) { points[i] = lattice(positions[i]); });
    return points;
}

} // namespace pbm::build
