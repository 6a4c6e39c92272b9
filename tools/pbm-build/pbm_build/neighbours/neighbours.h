// The nearest other points of a point.
// Based on: Lauterbach, Garland, Sengupta, Luebke, Manocha. Fast BVH Construction on GPUs. 2009 (boxes around
// consecutive points of the Morton curve: a tree built in one pass)
#pragma once

#include "pbm_build/neighbours/leaf_scan.h"
#include "pbm_format/model/octree.h"

#include <limits>
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

    const std::vector<LatticePoint> &points() const { return points_; }

  private:
    friend class NeighbourCursor;
    Box box_of(std::size_t leaf) const;

    std::vector<LatticePoint> points_;
    std::vector<Leaf> leaves_;               // of kFan points each, in their order
    std::vector<std::vector<Boxes>> levels_; // [0] groups of boxes of leaves, [L] of groups of [L - 1]; the last is one
    std::vector<std::size_t> boxes_of_level_; // [L] without the padding
};

// Searches for one thread; fastest in ascending order of points, with the same number of neighbours each time. The
// leaves near a leaf are collected once for all of its points, and the distance of one point's neighbours predicts that
// of the next.
class NeighbourCursor {
  public:
    explicit NeighbourCursor(const PointNeighbours &tree) : tree_(tree) {}

    // Fills `found` with the points nearest to `point`, itself excluded, and returns their number (below found.size()
    // only in a small cloud). Equal distances are sorted by z, y, x, so that translating the cloud changes nothing,
    // equal positions by index. `found` is not empty.
    std::size_t nearest(std::size_t point, std::span<NearPoint> found);

    // Searches only a few dozen points before and after `point` in their order: much faster, and the k-th distance is
    // never below that of `nearest`.
    std::size_t nearest_in_order(std::size_t point, std::span<NearPoint> found);

    // The same for any place, which need not be that of a point: the nearest points within a squared distance of
    // `limit`.
    std::size_t nearest_within(const LatticePoint &at, float limit, std::span<NearPoint> found);

  private:
    // The place of a search, and the point that it does not find.
    struct Query {
        LatticePoint at;
        std::size_t excluded;
    };
    void enter(std::size_t leaf);
    void collect(const Box &own, float limit);
    std::size_t scan(const LeafList &leaves, const Query &query, float limit, std::span<NearPoint> found);

    static constexpr std::size_t kNoLeaf = std::numeric_limits<std::size_t>::max(), kNoPoint = kNoLeaf;
    static constexpr float kUnlimited = std::numeric_limits<float>::infinity();

    const PointNeighbours &tree_;
    std::size_t leaf_ = kNoLeaf; // of the last query
    LeafList near_;              // leaves within the squared distance reach_ of it
    LeafList beside_;            // itself, the one before and the one behind
    float reach_ = -1;
    float predicted_ = kUnlimited; // squared distance that probably holds all neighbours of the next point
    Candidates candidates_;
};

// Centres of voxels, at most 2^32 - 1, as points on the grid of voxels.
std::vector<LatticePoint> centres_of(std::span<const MortonCode> codes);

} // namespace pbm::build
