#include "pbm_format/model/octree.h"

#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace pbm {
namespace {

// The figure in BVG.md 4: depth 2, leaves 0, 7 and 63.
const std::vector<MortonCode> kThreeLeaves = {0, 7, 63};
const LevelMasks kThreeLeavesMasks = {{}, {0x81}, {0x81, 0x80}};

std::vector<MortonCode> random_codes(int depth, std::size_t count, std::uint64_t seed) {
    test::Random random(seed);
    std::set<MortonCode> codes;
    while (codes.size() < count)
        codes.insert(random.below(MortonCode{1} << 3 * depth));
    return {codes.begin(), codes.end()};
}

std::vector<MortonCode> decode(const LevelMasks &masks) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < masks.size(); ++level)
        codes = value_of(expand_level(codes, masks[level], std::size_t{1} << 24));
    return codes;
}

TEST(Octree, ThreeLeavesAreTheMasksOfTheFigure) {
    EXPECT_EQ(encode_octree(kThreeLeaves, 2), kThreeLeavesMasks);
    EXPECT_EQ(decode(kThreeLeavesMasks), kThreeLeaves);
}

TEST(Octree, MortonCodesInterleaveXLowest) {
    EXPECT_EQ(morton_encode(1, 0, 0), 1U);
    EXPECT_EQ(morton_encode(0, 1, 0), 2U);
    EXPECT_EQ(morton_encode(0, 0, 1), 4U);
    EXPECT_EQ(morton_encode(65535, 65535, 65535), (MortonCode{1} << 48) - 1);
    test::Random random(3);
    for (int i = 0; i < 1000; ++i) {
        const auto x = static_cast<std::uint32_t>(random.below(65536)),
                   y = static_cast<std::uint32_t>(random.below(65536)),
                   z = static_cast<std::uint32_t>(random.below(65536));
        EXPECT_EQ(morton_decode(morton_encode(x, y, z)), (std::array{x, y, z}));
    }
}

TEST(Octree, RandomLeavesSurviveTheRoundTripAtEveryDepth) {
    for (int depth = 1; depth <= kMaxDepth; ++depth) {
        const std::size_t count = depth == 1 ? 5 : 60;
        const auto codes = random_codes(depth, count, static_cast<std::uint64_t>(depth));
        EXPECT_EQ(decode(encode_octree(codes, depth)), codes);
    }
}

// Masks are counted eight at a time, and 31 eights fill the bytes of a sum.
TEST(Octree, ChildrenOfManyMasksAreCounted) {
    Bytes full, random;
    test::Random numbers(4);
    std::uint64_t children = 0;
    for (std::size_t masks = 0; masks <= 1000; ++masks) {
        ASSERT_EQ(count_children(full), 8 * masks);
        ASSERT_EQ(count_children(random), children) << masks;
        full.push_back(0xFF);
        random.push_back(static_cast<std::uint8_t>(numbers.below(256)));
        for (unsigned bit = 0; bit < 8; ++bit)
            children += random.back() >> bit & 1U;
    }
}

TEST(Octree, AMissingMaskIsRefused) {
    const std::vector<MortonCode> parents = {0, 7};
    const Bytes one = {0x81};
    const auto result = expand_level(parents, one, 100);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::truncated);
    EXPECT_EQ(result.error().offset, 1U);
}

TEST(Octree, AZeroMaskIsRefusedWhereItStands) {
    const std::vector<MortonCode> parents = {0, 7};
    const Bytes zero = {0x81, 0x00};
    const auto result = expand_level(parents, zero, 100);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::bad_octree);
    EXPECT_EQ(result.error().offset, 1U);
}

TEST(Octree, MoreChildrenThanAllowedAreRefused) {
    const std::vector<MortonCode> parents = {0, 7};
    const Bytes full = {0xFF, 0xFF};
    EXPECT_TRUE(expand_level(parents, full, 16));
    const auto result = expand_level(parents, full, 15);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::too_large);
}

TEST(Octree, SubtreeStartsFindTheEightOctantGrids) {
    const int depth = 6;
    const auto codes = random_codes(depth, 3000, 5);
    const LevelMasks masks = encode_octree(codes, depth);
    const auto starts = subtree_starts(masks, 1);
    ASSERT_EQ(starts[1].size(), 9U);
    for (std::size_t octant = 0; octant < 8; ++octant) {
        const MortonCode first = static_cast<MortonCode>(octant) << 3 * (depth - 1);
        const auto expected =
            static_cast<std::uint64_t>(std::lower_bound(codes.begin(), codes.end(), first) - codes.begin());
        EXPECT_EQ(starts[6][octant], expected);
    }
    EXPECT_EQ(starts[6][8], codes.size());
}

// Chunks by rule 5.1, slowly: counts the points of each node and keeps the maximal nodes.
std::vector<ChunkShape> chunks_by_definition(const std::vector<MortonCode> &codes, int depth, int level,
                                             std::uint32_t limit) {
    const auto count_at = [&](int target, int root_depth, MortonCode prefix) {
        std::set<MortonCode> nodes;
        for (const MortonCode code : codes)
            if (code >> 3 * (depth - root_depth) == prefix)
                nodes.insert(code >> 3 * (depth - target));
        return static_cast<std::uint32_t>(nodes.size());
    };
    std::vector<ChunkShape> chunks;
    std::vector<std::pair<int, MortonCode>> open{{0, 0}};
    while (!open.empty()) {
        const auto [root_depth, prefix] = open.back();
        open.pop_back();
        const std::uint32_t points = count_at(level, root_depth, prefix);
        if (points == 0)
            continue;
        if (points > limit) {
            for (MortonCode child = 8; child-- > 0;)
                open.emplace_back(root_depth + 1, prefix << 3 | child);
            continue;
        }
        chunks.push_back({.root_depth = static_cast<std::uint8_t>(root_depth),
                          .root_prefix = prefix,
                          .points = points,
                          .nodes = count_at(level - 1, root_depth, prefix),
                          .parents = level < 2 ? 0 : count_at(level - 2, root_depth, prefix),
                          .bricks = level < 3 ? 1 : count_at(level - 3, root_depth, prefix),
                          .parent_chunk = 0});
    }
    return chunks;
}

TEST(Chunks, AreTheMaximalSubtreesWithinTheLimitAndNest) {
    const int depth = 6;
    const auto codes = random_codes(depth, 4000, 9);
    const auto levels = split_into_chunks(encode_octree(codes, depth), 512);
    for (int level = 1; level <= depth; ++level) {
        auto chunks = levels[static_cast<std::size_t>(level)];
        const auto &above = levels[static_cast<std::size_t>(level) - 1];
        std::uint64_t filled = 0;
        std::uint32_t parent = 0;
        for (ChunkShape &chunk : chunks) {
            if (level > 1) {
                if (filled == above[parent].points) {
                    ++parent;
                    filled = 0;
                }
                EXPECT_EQ(chunk.parent_chunk, parent);
                filled += chunk.nodes;
                EXPECT_LE(filled, above[parent].points);
            }
            chunk.parent_chunk = 0;
        }
        EXPECT_EQ(chunks, chunks_by_definition(codes, depth, level, 512)) << "level " << level;
    }
    EXPECT_GT(levels.back().size(), 5U);
}

} // namespace
} // namespace pbm
