// The nearest other voxels of a voxel, and points of a point.
// Based on: Lauterbach, Garland, Sengupta, Luebke, Manocha. Fast BVH Construction on GPUs. 2009 (boxes around what is
//           neighbouring along the Morton curve: a tree for the price of one pass)
#pragma once

#include "pbm_build/grid/lattice.h"
#include "pbm_format/model/octree.h"

#include <array>
#include <span>
#include <vector>

namespace pbm::build {

struct NearPoint {
    std::uint32_t point;     // index into the points
    double squared_distance; // in lattice steps
};

class PointNeighbours {
  public:
    // At most 2^32 - 1 points, which may lie in one place. Fast if they lie along the Morton curve. Coordinates
    // 0..2^30 - 1.
    explicit PointNeighbours(std::vector<LatticePoint> points);

    // Fills `found` with the nearest points around `point`, itself left out. Those at one distance come by z, then y,
    // then x, so that moving the cloud changes nothing, and those in one place by index. Returns how many there are
    // (fewer than asked only in a small cloud). Safe from several threads.
    std::size_t nearest(std::size_t point, std::span<NearPoint> found) const;

    // As nearest, but only among a few dozen points before and behind `point` in their order: much faster, and no
    // distance is below what `nearest` finds in the same place.
    std::size_t nearest_in_order(std::size_t point, std::span<NearPoint> found) const;

    const std::vector<LatticePoint> &points() const { return points_; }

  private:
    class Search;
    static constexpr std::size_t kFan = 16;       // points of a leaf, boxes of a group
    using Lanes = std::array<std::int32_t, kFan>; // one coordinate of each: loops over it become vectors
    using Leaf = std::array<Lanes, 3>;            // [axis], padded with the last point
    struct Boxes {
        std::array<Lanes, 3> low, high; // [axis]
    };

    std::vector<LatticePoint> points_;
    std::vector<Leaf> leaves_;               // of kFan points each, in their order
    std::vector<std::vector<Boxes>> levels_; // [0] groups of boxes of leaves, [L] of groups of [L - 1]; the last is one
    std::vector<std::size_t> boxes_of_level_; // [L] how many there are; padding follows
};

struct Neighbour {
    std::uint32_t voxel;    // index into the codes
    float squared_distance; // between the centres, in voxels
    glm::ivec3 offset;      // from the voxel asked for, in voxels
};

class VoxelNeighbours {
  public:
    // `codes` ascending and unique, at most 2^32 - 1.
    explicit VoxelNeighbours(std::span<const MortonCode> codes);

    // As PointNeighbours::nearest, at most kMost.
    static constexpr std::size_t kMost = 31;
    std::size_t nearest(std::size_t voxel, std::span<Neighbour> found) const;

  private:
    PointNeighbours centres_;
};

} // namespace pbm::build
