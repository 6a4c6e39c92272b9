// Splits levels into chunks: the rule of BVG.md 5.1 and 5.2 as a function of the octree.
#include "pbm_format/levels/chunk_split.h"

#include <algorithm>

namespace pbm {

void ChunkSplit::add_chunks(int level, const Child &node, const NodeCounts *parent) {
    for (int of = level + 1; of <= depth_; ++of) {
        const auto l = static_cast<std::size_t>(of);
        if (node.counts[l] > chunk_points_ || (parent != nullptr && (*parent)[l] <= chunk_points_))
            continue;
        levels_[l].push_back({.root_depth = static_cast<std::uint8_t>(level),
                              .root_prefix = node.code,
                              .points = static_cast<std::uint32_t>(node.counts[l]),
                              .nodes = static_cast<std::uint32_t>(node.counts[l - 1]),
                              .parents = of < 2 ? 0 : static_cast<std::uint32_t>(node.counts[l - 2]),
                              .bricks = of < 3 ? 1 : static_cast<std::uint32_t>(node.counts[l - 3])});
    }
}

void ChunkSplit::add(int level, const NodeCounts &counts,
                     const std::function<std::uint8_t(int level, std::uint64_t index)> &mask_of) {
    const auto depth = static_cast<std::size_t>(depth_);
    const auto join = [&](Node &parent, const Node &node, int level_of_node, MortonCode code) {
        for (auto l = static_cast<std::size_t>(level_of_node); l <= depth; ++l)
            parent.counts[l] += node.counts[l];
        parent.children.push_back({code, node.counts});
    };
    const auto close = [&](Node &node, int level_of_node, std::uint64_t) {
        node.counts[static_cast<std::size_t>(level_of_node)] = 1;
        if (node.counts[depth] > chunk_points_)
            for (const Child &child : node.children)
                add_chunks(level_of_node + 1, child, &node.counts);
        if (level_of_node == 0)
            add_chunks(0, {0, node.counts}, nullptr);
    };
    if (level == 0)
        add_chunks(0, {0, counts}, nullptr);
    merge_.add(level, counts, {counts, {}}, mask_of, join, close);
}

std::vector<std::vector<ChunkShape>> ChunkSplit::finish() {
    const auto place = [](const ChunkShape &chunk) { return chunk.root_prefix << 3 * (kMaxDepth - chunk.root_depth); };
    for (std::size_t level = 1; level < levels_.size(); ++level) {
        std::vector<ChunkShape> &chunks = levels_[level];
        std::sort(chunks.begin(), chunks.end(),
                  [&](const ChunkShape &a, const ChunkShape &b) { return place(a) < place(b); });
        if (level < 2)
            continue;
        std::size_t above = 0;
        std::uint64_t first_node = 0, nodes_above = levels_[level - 1][0].points; // up to the end of chunk `above`
        for (ChunkShape &chunk : chunks) {
            while (first_node >= nodes_above)
                nodes_above += levels_[level - 1][++above].points;
            chunk.parent_chunk = static_cast<std::uint32_t>(above);
            first_node += chunk.nodes;
        }
    }
    return std::move(levels_);
}

std::vector<std::vector<ChunkShape>> split_into_chunks(const LevelMasks &masks, std::uint32_t chunk_points) {
    // At least 512 points per chunk ensure that every chunk holds whole bricks, parents and grandparents, and that no
    // chunk begins below a node three levels above the finest.
    assert(chunk_points >= 512);
    const int depth = static_cast<int>(masks.size()) - 1, level = std::max(0, depth - 3);
    const auto starts = subtree_starts(masks, level);
    ChunkSplit split(depth, chunk_points);
    for (std::size_t i = 0; i + 1 < starts.back().size(); ++i) {
        NodeCounts counts{};
        for (auto l = static_cast<std::size_t>(level); l < starts.size(); ++l)
            counts[l] = starts[l][i + 1] - starts[l][i];
        split.add(level, counts, [&](int l, std::uint64_t index) {
            return masks[static_cast<std::size_t>(l) + 1][static_cast<std::size_t>(index)];
        });
    }
    return split.finish();
}

} // namespace pbm
