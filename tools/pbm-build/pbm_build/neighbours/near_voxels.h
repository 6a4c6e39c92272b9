// The nearest occupied voxels. Most lie within a few voxels, so they are read in shells of increasing distance from a
// small grid around a node of the octree; a tree answers the rest.
#pragma once

#include "pbm_build/neighbours/neighbours.h"

#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

namespace pbm::build {

struct Neighbour {
    std::uint32_t voxel;    // index into the codes
    float squared_distance; // between the centres, in voxels
    glm::ivec3 offset;      // from the queried voxel, in voxels
};

// Occupied voxels with the first one of each coarse node. Refers to `codes`: ascending, unique, of a grid of `depth`.
class NearVoxels {
  public:
    NearVoxels(std::span<const MortonCode> codes, int depth);
    std::size_t first_not_below(MortonCode code) const; // index; the number of codes if there is none

  private:
    friend class NearVoxelCursor;
    const PointNeighbours &tree() const; // of the centres; made when the first voxel needs it

    std::span<const MortonCode> codes_;
    int depth_;
    int shift_;                         // of a code, to its place in starts_
    std::vector<std::uint32_t> starts_; // first voxel of each node of a coarse level, and the end
    mutable std::once_flag tree_made_;
    mutable std::unique_ptr<PointNeighbours> tree_;
};

// Searches for one thread; fastest in ascending order of voxels.
class NearVoxelCursor {
  public:
    explicit NearVoxelCursor(const NearVoxels &voxels);

    // As PointNeighbours::nearest, at most kMax.
    static constexpr std::size_t kMax = 48;
    std::size_t nearest(std::size_t voxel, std::span<Neighbour> found);

    // All others whose centres lie within sqrt(squared) voxels, nearest first; squared <= 16. Valid until the next
    // call.
    std::span<const Neighbour> within(std::size_t voxel, int squared);

  private:
    const std::uint32_t *grid_around(std::size_t voxel); // the voxel's place in it
    std::size_t nearest_by_tree(std::size_t voxel, std::span<Neighbour> found);
    void gather(MortonCode node);

    const NearVoxels &voxels_;
    std::optional<NeighbourCursor> in_tree_; // made with the tree
    MortonCode node_ = ~MortonCode{0};       // at the centre of the grid
    std::vector<std::uint32_t> grid_;        // [z][y][x] index of the voxel + 1; 0: empty
    std::vector<std::size_t> filled_;        // places in the grid that are not 0
    std::vector<Neighbour> within_;
};

} // namespace pbm::build
