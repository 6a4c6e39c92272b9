// The nearest occupied voxels, where most lie within a few voxels: cells of the octree itself instead of a tree of its
// own, and integers that are counted instead of sorted.
#pragma once

#include "pbm_build/neighbours.h"

#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace pbm::build {

// Occupied voxels and where those of each cell begin. Refers to `codes`: ascending, unique, of a grid of `depth`.
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
    explicit NearVoxelCursor(const NearVoxels &voxels) : voxels_(voxels) {}

    // The found.size() <= VoxelNeighbours::kMost nearest of the others by distance, then index; fewer if there are not
    // so many. Beyond four voxels which of equally distant ones are found last is VoxelNeighbours' choice.
    std::size_t nearest(std::size_t voxel, std::span<Neighbour> found);

  private:
    void gather(MortonCode cell);

    const NearVoxels &voxels_;
    MortonCode cell_ = ~MortonCode{0};                // whose surroundings these are:
    std::vector<std::uint32_t> around_;               // voxels of the 27 cells, ascending
    std::array<std::vector<std::int16_t>, 3> places_; // per axis, in voxels from the corner of cell_
    std::vector<std::int16_t> squared_;               // distances from the voxel asked for
    std::vector<std::uint32_t> close_;                // those within reach, as indices of around_
};

} // namespace pbm::build
