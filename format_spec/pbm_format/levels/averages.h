// Averages of the coarser levels, one subtree of the octree after the other. BVG.md 7 and 17.3
//
// average_levels (model.h) applies them to a model in memory, the validator to the chunks of a file.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_format/model/normal.h"

namespace pbm {

// Sums over the finest points below one node, for streams that nearly every model has. The sums fit into 63 bits: at
// most 2^32 votes of at most 2^30.
struct CommonSums {
    std::uint64_t votes = 0;
    std::array<std::int64_t, 3> normal{};
    std::array<std::int64_t, 6> moment{}; // of the normals: xx xy xz yy yz zz
    std::array<std::uint64_t, 3> colour{};
    std::uint8_t child_radius = 0; // largest among the children
    bool two_sided = false;        // any child is
};

// Adds the normal of a point; the caller counts its vote.
inline void add_normal(const IntegerNormal &n, CommonSums &to) {
    for (std::size_t c = 0; c < 3; ++c)
        to.normal[c] += n[c];
    const std::array<std::int32_t, 6> products{n[0] * n[0], n[0] * n[1], n[0] * n[2],
                                               n[1] * n[1], n[1] * n[2], n[2] * n[2]};
    for (std::size_t c = 0; c < 6; ++c)
        to.moment[c] += products[c];
}

// The normal of a wall's plane, whose normals cancel: the column of the moment with the largest diagonal. BVG.md 7.3
std::array<std::int64_t, 3> plane_normal(const CommonSums &sums);

// Adds the sums of the remaining streams.
struct PointSums : CommonSums {
    std::array<std::uint64_t, kMaxMaterials> materials{}; // votes
    std::array<std::uint64_t, kMaxStreams> means{};       // of the model's streams, scaled to 8 bits

    void add(const PointSums &other);
};

// The nodes below and with one node of an octree of `depth` levels.
struct Subtree {
    int level = 0; // of its root, above the finest
    int depth = 0;
    std::array<ByteView, kMaxDepth> masks{}; // [level]: child masks of its nodes of this level
    PointView points{};                      // its finest points
};

// Where the averages of the nodes of a level go: to the points from `first` on, which must be there.
struct AveragedNodes {
    PointAttributes *points = nullptr;
    std::size_t first = 0;
};

// Averages all nodes of a subtree; `to` holds a place for each of its levels. Returns what the root adds to the sums of
// its parent: the sums of its points, its own radius, and whether it is two-sided.
PointSums average_subtree(const Subtree &subtree, const AttributeSet &set,
                          const std::array<AveragedNodes, kMaxDepth> &to);
// Averages one node of `level` from the sums of its children. Returns what it adds to the sums of its parent.
PointSums average_node(int level, int depth, const PointSums &sums, const AttributeSet &set, const AveragedNodes &to);

// What is known of the stored values of a field in some of the finest points.
struct FieldSums {
    std::uint64_t sum = 0, votes = 0; // of the points that have a value
    std::uint32_t highest = 0;
    std::vector<std::uint32_t> counts{}; // how often each stored value occurs; only for majorities

    void add(const FieldSums &other);
};
FieldSums sum_field(const Field &field, ByteView stored);
// The stored value of a node with these points below it.
std::uint32_t average_field(const Field &field, const FieldSums &sums);
// Averages a field over the nodes of a subtree, from the stored values of its finest points; `to[level]` gets those of
// its nodes of the level.
void average_field(const Field &field, const Subtree &subtree, ByteView stored, std::array<Bytes, kMaxDepth> &to);

} // namespace pbm
