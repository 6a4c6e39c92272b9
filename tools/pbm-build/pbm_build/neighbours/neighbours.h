// The nearest other points of a point.
// Based on: Lauterbach, Garland, Sengupta, Luebke, Manocha. Fast BVH Construction on GPUs. 2009 (boxes around
// consecutive points of the Morton curve: a tree built in one pass)
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
    // At most 2^32 - 1 points, coordinates 0..2^30 - 1; positions may repeat. Fast if sorted along the Morton curve.
    explicit PointNeighbours(std::vector<LatticePoint> points);

    // Fills `found` with the points nearest to `point`, itself excluded, and returns their number (below found.size()
    // only in a small cloud). Equal distances are sorted by z, y, x, so that translating the cloud changes nothing,
    // equal positions by index. Safe to call from several threads.
    std::size_t nearest(std::size_t point, std::span<NearPoint> found) const;

    // Searches only a few dozen points before and after `point` in their order: much faster, and the k-th distance is
    // never below that of `nearest`.
    std::size_t nearest_in_order(std::size_t point, std::span<NearPoint> found) const;

    const std::vector<LatticePoint> &points() const { return points_; }

  private:
    class Search;
    static constexpr std::size_t kFan = 16;       // points of a leaf, boxes of a group
    using Lanes = std::array<std::int32_t, kFan>; // one coordinate of each, for vectorised loops
    using Leaf = std::array<Lanes, 3>;            // [axis], padded with the last point
    struct Boxes {
        std::array<Lanes, 3> low, high; // [axis]
    };

    std::vector<LatticePoint> points_;
    std::vector<Leaf> leaves_;               // of kFan points each, in their order
    std::vector<std::vector<Boxes>> levels_; // [0] groups of boxes of leaves, [L] of groups of [L - 1]; the last is one
    std::vector<std::size_t> boxes_of_level_; // [L] without the padding
};

// Centres of voxels, at most 2^32 - 1, as points on the grid of voxels.
std::vector<LatticePoint> centres_of(std::span<const MortonCode> codes);

} // namespace pbm::build
