// The nearest occupied voxels, where most lie within a few voxels: a small grid of those around a node of the octree,
// read outwards in shells, instead of a tree.
#pragma once

#include "pbm_build/neighbours/neighbours.h"

#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace pbm::build {

// Occupied voxels and where those of each node begin. Refers to `codes`: ascending, unique, of a grid of `depth`.
class NearVoxels {
  public:
    NearVoxels(std::span<const MortonCode> codes, int depth);

  private:
    friend class NearVoxelCursor;
    std::size_t first_not_below(MortonCode code) const;
    const VoxelNeighbours &tree() const; // made when the first voxel needs it

    std::span<const MortonCode> codes_;
    int depth_;
    int shift_;                         // of a code, to its place in starts_
    std::vector<std::uint32_t> starts_; // first voxel of each node of a coarse level, and the end
    mutable std::once_flag tree_made_;
    mutable std::unique_ptr<VoxelNeighbours> tree_;
};

// Searches of one thread, fastest in ascending order.
class NearVoxelCursor {
  public:
    explicit NearVoxelCursor(const NearVoxels &voxels);

    // As VoxelNeighbours::nearest.
    std::size_t nearest(std::size_t voxel, std::span<Neighbour> found);

  private:
    void gather(MortonCode node);

    const NearVoxels &voxels_;
    MortonCode node_ = ~MortonCode{0}; // whose surroundings these are:
    std::vector<std::uint32_t> grid_;  // [z][y][x] index of the voxel and 1, or 0 where there is none
    std::vector<std::size_t> filled_;  // places of it that are not 0
};

} // namespace pbm::build
