// Splits levels into chunks: the rule of BVG.md 5.1 and 5.2 as a function of the octree.
#include "pbm_format/model/octree.h"

#include <algorithm>

namespace pbm {

namespace {

// counts[r][i]: number of nodes of `level` below node i of level r, for r = level - 1 .. 0.
std::vector<std::vector<std::uint32_t>> descendants_at(const LevelMasks &masks, int level) {
    std::vector<std::vector<std::uint32_t>> counts(static_cast<std::size_t>(level));
    for (int r = level - 1; r >= 0; --r) {
        const Bytes &level_masks = masks[static_cast<std::size_t>(r) + 1];
        auto &here = counts[static_cast<std::size_t>(r)];
        here.resize(level_masks.size());
        if (r == level - 1) {
            for (std::size_t i = 0; i < here.size(); ++i)
                here[i] = kChildren[level_masks[i]];
            continue;
        }
        const auto &below = counts[static_cast<std::size_t>(r) + 1];
        std::size_t child = 0;
        for (std::size_t i = 0; i < here.size(); ++i) {
            std::uint32_t sum = 0;
            for (int left = kChildren[level_masks[i]]; left > 0; --left)
                sum += below[child++];
            here[i] = sum;
        }
    }
    return counts;
}

// Roots of the maximal subtrees with at most `limit` nodes of `level`, in Morton order.
std::vector<ChunkShape> find_roots(const LevelMasks &masks, int level, std::uint32_t limit) {
    const auto counts = descendants_at(masks, level);
    std::vector<ChunkShape> roots;
    struct OpenNode {
        std::size_t index;
        MortonCode code;
    };
    std::vector<OpenNode> open{{0, 0}}; // nodes of level r that are not in a chunk yet
    for (int r = 0; !open.empty(); ++r) {
        assert(r < level);
        const auto &here = counts[static_cast<std::size_t>(r)];
        std::vector<OpenNode> next;
        const Bytes &below = masks[static_cast<std::size_t>(r) + 1];
        std::size_t cursor = 0, first_child = 0; // first child of node `cursor`
        for (const OpenNode &node : open) {
            if (here[node.index] <= limit) {
                roots.push_back(
                    {.root_depth = static_cast<std::uint8_t>(r), .root_prefix = node.code, .points = here[node.index]});
                continue;
            }
            first_child += static_cast<std::size_t>(count_children(slice(below, cursor, node.index - cursor)));
            cursor = node.index;
            std::size_t child = first_child;
            for (unsigned mask = below[node.index]; mask != 0; mask &= mask - 1)
                next.push_back({child++, node.code << 3 | static_cast<unsigned>(std::countr_zero(mask))});
        }
        open = std::move(next);
    }
    const auto place = [](const ChunkShape &chunk) { return chunk.root_prefix << 3 * (kMaxDepth - chunk.root_depth); };
    std::sort(roots.begin(), roots.end(),
              [&](const ChunkShape &a, const ChunkShape &b) { return place(a) < place(b); });
    return roots;
}

// Advances `at` over masks with `children` children in total; returns the number of masks.
std::uint32_t take_masks(ByteView masks, std::size_t &at, std::uint32_t children) {
    const std::size_t first = at;
    for (std::uint32_t sum = 0; sum < children; ++at)
        sum += kChildren[masks[at]];
    return static_cast<std::uint32_t>(at - first);
}

} // namespace

std::vector<std::vector<ChunkShape>> split_into_chunks(const LevelMasks &masks, std::uint32_t chunk_points) {
    // At least 512 points per chunk ensure that every chunk holds whole bricks, parents and grandparents.
    assert(chunk_points >= 512);
    std::vector<std::vector<ChunkShape>> levels(masks.size());
    for (std::size_t level = 1; level < masks.size(); ++level) {
        levels[level] = find_roots(masks, static_cast<int>(level), chunk_points);
        std::size_t node = 0, parent = 0, brick = 0, above = 0;
        std::uint64_t nodes_above = 0; // nodes up to the end of chunk `above` of level - 1
        std::uint64_t first_node = 0;
        for (ChunkShape &chunk : levels[level]) {
            chunk.nodes = take_masks(masks[level], node, chunk.points);
            chunk.parents = level < 2 ? 0 : take_masks(masks[level - 1], parent, chunk.nodes);
            chunk.bricks = level < 3 ? 1 : take_masks(masks[level - 2], brick, chunk.parents);
            if (level >= 2) {
                if (nodes_above == 0)
                    nodes_above = levels[level - 1][0].points;
                while (first_node >= nodes_above)
                    nodes_above += levels[level - 1][++above].points;
                chunk.parent_chunk = static_cast<std::uint32_t>(above);
            }
            first_node += chunk.nodes;
        }
    }
    return levels;
}

} // namespace pbm
