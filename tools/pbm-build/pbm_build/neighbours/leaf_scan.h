// Comparisons of a point or a box with the leaves and boxes of a tree (neighbours.h), 16 at once.
#pragma once

#include "pbm_build/lattice/lattice.h"

#include <array>
#include <cstdint>
#include <vector>

namespace pbm::build {

inline constexpr std::size_t kFan = 16;       // points of a leaf, boxes of a group
using Lanes = std::array<std::int32_t, kFan>; // one coordinate of each

struct alignas(64) Leaf {
    std::array<Lanes, 3> at; // [axis], padded with the last point
};
struct alignas(64) Boxes {
    std::array<Lanes, 3> low, high; // [axis]
};
struct Box {
    LatticePoint low, high;
};
struct LeafList {
    std::vector<std::uint32_t> leaves; // indices
    std::vector<Boxes> boxes;          // theirs, in groups of kFan

    void clear();
    void add(std::uint32_t leaf, const Box &box);
};

// Squared distances are compared in single precision. The differences are exact, so the relative error is below this.
inline constexpr float kRounding = 1 + 1e-6F;

// Bit i: the squared distance between `box` and boxes[i] is at most `limit`.
std::uint32_t boxes_within(const Boxes &boxes, const Box &box, float limit);

// Points found in leaves, in ascending order of their distances with an accuracy of kOrder.
struct Candidates {
    static constexpr std::size_t kRoom = 128;
    static constexpr double kOrder = 1 + 0x1p-15;

    std::size_t count = 0;                     // at most kRoom
    std::array<std::uint32_t, kRoom> points{}; // index: leaf * kFan + place in the leaf
    alignas(64) std::array<std::int32_t, kRoom> keys{};
};

// Finds the points of the leaves near.leaves[first...] within the squared distance `limit` of `at`, itself and padding
// included. Returns the place of the next leaf to search: near.leaves.size(), unless `candidates` became full.
std::size_t points_within(const Leaf *leaves, const LeafList &near, std::size_t first, const LatticePoint &at,
                          float limit, Candidates &candidates);

} // namespace pbm::build
