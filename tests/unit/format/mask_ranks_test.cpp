// The rank filter against a slow one that follows the specification word by word.
#include "pbm_format/hashes/hash.h"
#include "pbm_format/levels/chunk_split.h"
#include "pbm_format/model/normal.h"
#include "pbm_format/streams/mask_ranks.h"
#include "pbm_format/streams/packed_rankings.h"

#include "unit/support/test_models.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bitset>
#include <fstream>
#include <numeric>
#include <string>

namespace pbm {
namespace {

using test::Random;

// ---- the text of BVG.md, rule by rule

Bytes read_table_file() {
    std::ifstream file(PBM_SOURCE_DIR "/format_spec/mask_ranks.txt");
    Bytes table;
    for (std::string line; std::getline(file, line);)
        if (!line.starts_with('#'))
            for (std::size_t i = 0; i + 1 < line.size(); i += 2)
                table.push_back(static_cast<std::uint8_t>(std::stoi(line.substr(i, 2), nullptr, 16)));
    return table;
}

struct Node {
    unsigned place = 0;
    unsigned parent_mask = 1;
};

std::vector<Node> nodes_below(ByteView parent_masks, std::size_t count) {
    std::vector<Node> nodes;
    for (const std::uint8_t mask : parent_masks)
        for (unsigned place = 0; place < 8; ++place)
            if ((mask >> place & 1) != 0)
                nodes.push_back({place, mask});
    nodes.resize(count);
    return nodes;
}

class SlowFilter {
  public:
    // Image of each child place, and the context.
    struct View {
        std::array<unsigned, 8> image{};
        std::size_t context = 0;

        unsigned image_of_mask(unsigned mask) const {
            unsigned result = 0;
            for (unsigned p = 0; p < 8; ++p)
                result |= (mask >> p & 1) << image[p];
            return result;
        }
    };

    static View view(Node node, std::uint16_t normal) {
        const IntegerNormal n = integer_normal_table()[normal & kNormalIndexMask];
        const std::array<int, 3> c = centroid(normal & 1023U);
        std::array<unsigned, 3> axes{};
        for (const std::array<unsigned, 3> &order :
             {std::array{0U, 1U, 2U}, std::array{0U, 2U, 1U}, std::array{1U, 0U, 2U}, std::array{1U, 2U, 0U},
              std::array{2U, 0U, 1U}, std::array{2U, 1U, 0U}})
            if (c[order[0]] >= c[order[1]] && c[order[1]] >= c[order[2]]) {
                axes = order;
                break;
            }
        View view;
        for (unsigned p = 0; p < 8; ++p)
            for (unsigned i = 0; i < 3; ++i) {
                const bool negative = n[axes[i]] < 0, upper = (p >> axes[i] & 1) != 0;
                view.image[p] |= (upper != negative ? 1U : 0U) << i;
            }
        const int u = 6 * c[axes[1]] / (c[axes[0]] + 1), v = 6 * c[axes[2]] / (c[axes[0]] + 1);
        const unsigned place = view.image[node.place], mask = view.image_of_mask(node.parent_mask);
        unsigned seen = 0;
        for (unsigned b = 0; b < 8; ++b)
            seen |= (mask >> (b ^ place) & 1) << b;
        EXPECT_EQ(seen & 1, 1U);
        view.context = 1024 * static_cast<std::size_t>(u * (u + 1) / 2 + v) + 128 * place + seen / 2;
        return view;
    }

    std::uint8_t code(unsigned mask, Node node, std::uint16_t normal) const {
        const View v = view(node, normal);
        const auto ranking = table_.begin() + 21504 + 256 * table_[v.context];
        const auto at = std::find(ranking, ranking + 256, static_cast<std::uint8_t>(v.image_of_mask(mask)));
        return static_cast<std::uint8_t>(at - ranking);
    }

    Bytes codes(ByteView masks, const MaskContext &context) const {
        const std::vector<Node> nodes = nodes_below(context.parent_masks, masks.size());
        Bytes codes(masks.size());
        for (std::size_t i = 0; i < masks.size(); ++i)
            codes[i] = code(masks[i], nodes[i], context.node_normals[i]);
        return codes;
    }

  private:
    // 6.1.2 in coordinates: child corner = (corner + corner) / 2.
    static std::array<int, 3> centroid(unsigned digits) {
        std::array<std::array<int, 3>, 3> t{{{32, 0, 0}, {0, 32, 0}, {0, 0, 32}}};
        for (int shift = 8; shift >= 0; shift -= 2) {
            const auto old = t;
            const unsigned digit = digits >> shift & 3;
            const auto middle = [&](std::size_t a, std::size_t b, std::size_t axis) {
                return (old[a][axis] + old[b][axis]) / 2;
            };
            for (std::size_t corner = 0; corner < 3; ++corner)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    t[corner][axis] =
                        digit == 0 ? middle((corner + 1) % 3, (corner + 2) % 3, axis) : middle(corner, digit - 1, axis);
        }
        return {t[0][0] + t[1][0] + t[2][0], t[0][1] + t[1][1] + t[2][1], t[0][2] + t[1][2] + t[2][2]};
    }

    Bytes table_ = read_table_file();
};

// ----

Bytes ranked(ByteView masks, const MaskContext &context) {
    Bytes codes(masks.size());
    rank_masks(masks, context, codes);
    return codes;
}

Bytes unranked(ByteView codes, const MaskContext &context) {
    Bytes masks(codes.size());
    unrank_masks(codes, context, masks);
    return masks;
}

Bytes random_bytes(Random &random, std::size_t count, std::uint64_t lowest = 0) {
    Bytes bytes(count);
    for (std::uint8_t &byte : bytes)
        byte = static_cast<std::uint8_t>(lowest + random.below(256 - lowest));
    return bytes;
}

std::vector<std::uint16_t> random_normals(Random &random, std::size_t count) {
    std::vector<std::uint16_t> normals(count);
    for (std::uint16_t &normal : normals)
        normal = static_cast<std::uint16_t>(random.below(65536));
    return normals;
}

TEST(MaskRanks, TheTableOfTheSpecificationIsTheOneInTheLibrary) {
    const ByteView table = mask_rank_table();
    EXPECT_EQ(read_table_file(), Bytes(table.begin(), table.end()));
    ASSERT_EQ(table.size(), 54272U);
    EXPECT_EQ(hash64(table), 0x2302B7EBAB6BD564U);
    for (std::size_t context = 0; context < 21504; ++context)
        ASSERT_LT(table[context], 128) << context;
    Bytes every_mask(256);
    std::iota(every_mask.begin(), every_mask.end(), std::uint8_t{0});
    for (std::size_t ranking = 0; ranking < 128; ++ranking) {
        Bytes row(table.begin() + 21504 + static_cast<std::ptrdiff_t>(256 * ranking),
                  table.begin() + 21504 + static_cast<std::ptrdiff_t>(256 * (ranking + 1)));
        EXPECT_EQ(row.back(), 0) << ranking;
        std::sort(row.begin(), row.end());
        EXPECT_EQ(row, every_mask) << ranking;
    }
}

TEST(MaskRanks, AreTheSameWhenPackedAndUnpacked) {
    MaskRankTable table{};
    std::copy_n(mask_rank_table().begin(), table.size(), table.begin());
    EXPECT_EQ(PackedRankings(table).unpacked(), table);
    std::swap(table[0], table[1]); // the rankings of two contexts
    std::reverse(table.end() - 256, table.end());
    EXPECT_EQ(PackedRankings(table).unpacked(), table);
}

TEST(MaskRanks, TheExampleOfTheSpecification) {
    // Mask 3f: the fourth child in order is child 3.
    const Bytes parents = {0x3F}, masks = {0x2F, 0x2F, 0x2F, 0x2F, 0x2F, 0x2F};
    const std::vector<std::uint16_t> normals(6, 0x07D2);
    const MaskContext context{parents, normals};
    std::vector<PlacedMask> placed(6);
    place_masks(context, placed);
    EXPECT_EQ(placed[3].context, 1658);
    EXPECT_EQ(mask_image(0x2F, placed[3].symmetry), 0x57);
    EXPECT_EQ(mask_rank_table()[1658], 111);
    EXPECT_EQ(ranked(masks, context)[3], 4);
}

TEST(MaskRanks, EveryMaskHasACodeOfItsOwnInEveryContext) {
    // One normal per class. Below, each parent mask occurs 256 times, and its children take each mask once.
    std::array<int, kMaskNormalClasses> normal_of{};
    normal_of.fill(-1);
    for (int normal = kNormalCount - 1; normal >= 0; --normal)
        normal_of[SlowFilter::view({}, static_cast<std::uint16_t>(normal)).context / 1024] = normal;
    Bytes parents, masks;
    for (unsigned parent = 1; parent < 256; ++parent)
        for (unsigned mask = 0; mask < 256; ++mask) {
            parents.push_back(static_cast<std::uint8_t>(parent));
            masks.insert(masks.end(), static_cast<std::size_t>(std::popcount(parent)), static_cast<std::uint8_t>(mask));
        }
    std::bitset<kMaskContexts> contexts;
    for (const int normal : normal_of) {
        ASSERT_GE(normal, 0);
        const std::vector<std::uint16_t> normals(masks.size(), static_cast<std::uint16_t>(normal));
        const MaskContext context{parents, normals};
        const Bytes codes = ranked(masks, context);
        ASSERT_EQ(unranked(codes, context), masks) << normal;
        std::vector<PlacedMask> placed(masks.size());
        place_masks(context, placed);
        std::vector<std::bitset<256>> seen(kMaskContexts);
        for (std::size_t i = 0; i < codes.size(); ++i) {
            contexts.set(placed[i].context);
            seen[placed[i].context].set(codes[i]);
            ASSERT_EQ(codes[i] == 255, masks[i] == 0);
        }
        for (const std::bitset<256> &codes_seen : seen)
            ASSERT_TRUE(codes_seen.none() || codes_seen.all());
    }
    EXPECT_TRUE(contexts.all());
}

TEST(MaskRanks, CodesAreThoseOfTheText) {
    const SlowFilter slow;
    Random random(3);
    const Bytes parents = random_bytes(random, 8192, 1);
    const auto nodes = static_cast<std::size_t>(count_children(parents));
    const Bytes masks = random_bytes(random, nodes);
    std::vector<std::uint16_t> normals(nodes); // each index several times
    for (std::size_t i = 0; i < nodes; ++i)
        normals[i] = static_cast<std::uint16_t>(i % kNormalCount);
    const MaskContext context{parents, normals};
    EXPECT_EQ(ranked(masks, context), slow.codes(masks, context));
}

TEST(MaskRanks, LevelOneIsTheFirstChildOfMaskOne) {
    const SlowFilter slow;
    for (const std::uint16_t normal : std::array<std::uint16_t, 6>{0, 0x155, 0x3FF, 0x1C00, 0x1FFF, 0x2A5A})
        for (unsigned mask = 0; mask < 256; ++mask) {
            const std::vector<std::uint16_t> normals = {normal};
            const Bytes masks = {static_cast<std::uint8_t>(mask)};
            const Bytes codes = ranked(masks, {{}, normals});
            EXPECT_EQ(codes[0], slow.code(mask, {}, normal));
            EXPECT_EQ(unranked(codes, {{}, normals}), masks);
        }
}

TEST(MaskRanks, OnlyTheDirectionOfANormalMatters) {
    Random random(4);
    const Bytes parents = random_bytes(random, 500, 1);
    const auto nodes = static_cast<std::size_t>(count_children(parents));
    const Bytes masks = random_bytes(random, nodes);
    std::vector<std::uint16_t> normals = random_normals(random, nodes);
    const Bytes codes = ranked(masks, {parents, normals});
    for (std::uint16_t &normal : normals)
        normal &= kNormalIndexMask;
    EXPECT_EQ(ranked(masks, {parents, normals}), codes);
}

TEST(MaskRanks, ParentsThatDoNotAddUpLeaveTheRestAtPlaceZero) {
    const SlowFilter slow;
    Random random(5);
    // Block borders of the implementation lie near 1,024 nodes.
    for (const std::size_t nodes : {0U, 1U, 7U, 8U, 9U, 1023U, 1024U, 1025U, 1031U, 1032U, 1033U, 3000U})
        for (const std::size_t parent_count : {0U, 1U, 2U, 127U, 128U, 129U, 400U, 5000U})
            for (const std::uint64_t kind : {0U, 1U, 2U}) {
                Bytes parents(parent_count, kind == 0 ? 0 : 255);
                if (kind == 2)
                    parents = random_bytes(random, parent_count);
                const std::vector<std::uint16_t> normals = random_normals(random, nodes);
                const Bytes masks = random_bytes(random, nodes);
                const MaskContext context{parents, normals};
                const Bytes codes = ranked(masks, context);
                ASSERT_EQ(codes, slow.codes(masks, context)) << nodes << ' ' << parent_count << ' ' << kind;
                ASSERT_EQ(unranked(codes, context), masks) << nodes << ' ' << parent_count << ' ' << kind;
            }
}

TEST(MaskRanks, AnyCodesGiveMasksThatGiveTheCodes) {
    Random random(6);
    for (int round = 0; round < 50; ++round) {
        const Bytes parents = random_bytes(random, random.below(300));
        const std::size_t nodes = random.below(1500);
        const std::vector<std::uint16_t> normals = random_normals(random, nodes);
        const Bytes codes = random_bytes(random, nodes);
        const MaskContext context{parents, normals};
        ASSERT_EQ(ranked(unranked(codes, context), context), codes);
    }
}

TEST(MaskRanks, MasksAndCodesMayShareTheirMemory) {
    Random random(7);
    const Bytes parents = random_bytes(random, 700, 1);
    const auto nodes = static_cast<std::size_t>(count_children(parents));
    const std::vector<std::uint16_t> normals = random_normals(random, nodes);
    const Bytes masks = random_bytes(random, nodes);
    const MaskContext context{parents, normals};
    Bytes shared = masks;
    rank_masks(shared, context, shared);
    EXPECT_EQ(shared, ranked(masks, context));
    unrank_masks(shared, context, shared);
    EXPECT_EQ(shared, masks);
}

TEST(MaskRanks, ASphereChunkByChunkHasTheCodesOfItsLevelsAndFewAreLarge) {
    const SlowFilter slow;
    const Model model = test::sphere_model(6, {});
    LevelMasks masks;
    for (const Level &level : model.levels)
        masks.push_back(level.masks);
    const auto shapes = split_into_chunks(masks, 512);
    std::size_t small = 0, all = 0;
    for (std::size_t level = 1; level < masks.size(); ++level) {
        const ByteView parents = masks[level - 1];
        const std::span<const std::uint16_t> normals = model.levels[level - 1].points.normals;
        const Bytes whole = slow.codes(masks[level], {parents, normals});
        std::size_t first = 0, first_parent = 0;
        for (const ChunkShape &shape : shapes[level]) {
            const MaskContext context{parents.subspan(first_parent, shape.parents),
                                      normals.subspan(first, shape.nodes)};
            const ByteView part = ByteView(masks[level]).subspan(first, shape.nodes);
            const Bytes codes = ranked(part, context);
            ASSERT_TRUE(std::equal(codes.begin(), codes.end(), whole.begin() + static_cast<std::ptrdiff_t>(first)));
            const Bytes back = unranked(codes, context);
            ASSERT_TRUE(std::equal(back.begin(), back.end(), part.begin()));
            small += static_cast<std::size_t>(std::count_if(codes.begin(), codes.end(), [](auto c) { return c < 16; }));
            all += codes.size();
            first += shape.nodes;
            first_parent += shape.parents;
        }
    }
    EXPECT_GT(small, all * 9 / 10);
}

} // namespace
} // namespace pbm
