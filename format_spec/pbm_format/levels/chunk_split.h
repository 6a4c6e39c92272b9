// Splits the levels of an octree into chunks while its subtrees come by: the rule of BVG.md 5.1 and 5.2.
#pragma once

#include "pbm_format/levels/subtree_merge.h"

#include <functional>

namespace pbm {

class ChunkSplit {
  public:
    ChunkSplit(int depth, std::uint32_t chunk_points)
        : depth_(depth), chunk_points_(chunk_points), levels_(static_cast<std::size_t>(depth) + 1) {}

    // Adds the next subtree in Morton order: its root lies on `level`, `counts` are its nodes on that level and below.
    // It holds at most `chunk_points` points, or is a single node of level depth - 1. `mask_of(level, index)` gives the
    // child mask of a node above it.
    void add(int level, const NodeCounts &counts,
             const std::function<std::uint8_t(int level, std::uint64_t index)> &mask_of);

    // After all subtrees: the chunks of each level, in Morton order; result[0] is empty.
    std::vector<std::vector<ChunkShape>> finish();

  private:
    struct Child {
        MortonCode code = 0;
        NodeCounts counts{};
    };
    struct Node {
        NodeCounts counts{};
        std::vector<Child> children{};
    };

    // Notes the levels for which this node, whose parent holds more than `chunk_points` points, is the root of a chunk.
    void add_chunks(int level, const Child &node, const NodeCounts *parent);

    int depth_;
    std::uint32_t chunk_points_;
    SubtreeMerge<Node> merge_;
    std::vector<std::vector<ChunkShape>> levels_;
};

// Splits every level 1..depth into chunks; result[0] is empty. `masks` must be a well-formed octree. Depends only on
// the octree and `chunk_points`: the writer applies it, the validator verifies it (rule 5.2).
std::vector<std::vector<ChunkShape>> split_into_chunks(const LevelMasks &masks, std::uint32_t chunk_points);

} // namespace pbm
