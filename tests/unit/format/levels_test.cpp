#include "pbm_format/levels/averages.h"
#include "pbm_format/model/model.h"

#include "unit/support/test_models.h"

#include <gtest/gtest.h>

namespace pbm {
namespace {

std::uint16_t average_normal(const PointSums &sums) {
    PointAttributes points;
    points.resize(1, {});
    average_node(1, 2, sums, {}, {&points, 0});
    return points.normals[0];
}

// BVG.md 7.3: 4 (S . S) < (32,767 V)^2 in exact integers.
TEST(AverageNormals, AreTwoSidedIfTheSumIsLessThanHalfAsLongAsItCanBe) {
    for (int bits = 1; bits <= 31; ++bits)
        for (const std::int64_t more : {-1, 0, 1}) {
            PointSums sums;
            sums.votes = std::uint64_t{1} << bits;
            const std::int64_t half = std::int64_t{32767} << (bits - 1);
            sums.normal = {0, -half - more, 0};
            sums.moment = {0, 0, 0, half * 32767, 0, 0};
            EXPECT_EQ((average_normal(sums) & kTwoSidedBit) != 0, more < 0) << bits << " bits of votes, " << more;
            sums.normal = {3 * half / 5, 0, 4 * half / 5 + more * 3}; // 3, 4, 5
            if (more != 0) {
                EXPECT_EQ((average_normal(sums) & kTwoSidedBit) != 0, more < 0) << bits << " bits of votes, " << more;
            }
        }
}

// Squares of sums of many votes need more than 64 bits.
TEST(AverageNormals, NoNumberOfVotesOverflows) {
    for (int bits = 1; bits <= 31; ++bits)
        for (std::int64_t tenths = 1; tenths < 20; tenths += 2) {
            PointSums sums;
            sums.votes = std::uint64_t{1} << bits;
            const std::int64_t half = std::int64_t{32767} << (bits - 1);
            sums.normal = {0, tenths * half / 10, 0};
            sums.moment = {0, 0, 0, 1, 0, 0};
            EXPECT_EQ((average_normal(sums) & kTwoSidedBit) != 0, tenths < 10) << bits << " bits, " << tenths;
        }
}

// BVG.md 7.3: of equal ones the lowest.
TEST(AverageNormals, OfEqualMomentsTheFirstAxisGivesThePlane) {
    PointSums sums;
    sums.votes = 2;
    sums.two_sided = true;
    sums.moment = {5, 2, 0, 5, 1, 1};
    EXPECT_EQ(average_normal(sums), quantise_normal(5, 2, 0) | kTwoSidedBit);
    sums.moment = {5, 2, 0, 6, 1, 1};
    EXPECT_EQ(average_normal(sums), quantise_normal(2, 6, 1) | kTwoSidedBit);
}

// Two points in one node of level 1, depth 2.
Model two_points(std::uint16_t first, std::uint16_t second) {
    Model model;
    model.parameters.grid.depth = 2;
    model.parameters.attributes = {
        .colour = ColourFormat::rgb888, .material = true, .texture = true, .lights = 1, .shadow_bits = {}};
    model.parameters.attributes.shadow_bits[0] = {8, 4, 1};
    model.parameters.materials.resize(3);
    const std::vector<MortonCode> codes{0, 1};
    const LevelMasks masks = encode_octree(codes, 2);
    model.levels.resize(3);
    for (std::size_t level = 0; level < 3; ++level)
        model.levels[level].masks = masks[level];
    PointAttributes &points = model.levels[2].points;
    points.resize(2, model.parameters.attributes);
    points.normals = {first, second};
    points.radii = {200, 203};
    points.colours = {0, 0, 0, 255, 255, 255};
    points.materials = {2, 1};
    points.textures = {10, 13};
    points.shadows[0] = {0, 1};
    return model;
}

TEST(DetailLevels, AveragesAreTheRulesOfSectionSeven) {
    Model model = two_points(5, 5);
    average_levels(model, 1);
    const PointAttributes &one = model.levels[1].points;
    EXPECT_EQ(one.normals, (std::vector<std::uint16_t>{5}));
    EXPECT_EQ(one.radii, Bytes{covering_radius(203, 1)});
    EXPECT_EQ(one.colours, (Bytes{188, 188, 188})); // half of white in linear light
    EXPECT_EQ(one.materials, Bytes{1});             // one vote each: the lowest index
    EXPECT_EQ(one.textures, Bytes{12});             // 11.5 rounds up
    EXPECT_EQ(one.shadows[0], Bytes{8});            // 7.5 of 15 rounds up
    const PointAttributes &root = model.levels[0].points;
    EXPECT_EQ(root.shadows[0], Bytes{128}); // 127.5 of 255
    EXPECT_EQ(root.radii, Bytes{covering_radius(covering_radius(203, 1), 0)});
}

TEST(DetailLevels, AThinWallBecomesTwoSidedWithTheNormalOfItsPlane) {
    const std::uint16_t up = quantise_normal(0.01, 0.02, 1), down = quantise_normal(0.01, 0.02, -1);
    Model model = two_points(up, down);
    average_levels(model, 1);
    const std::uint16_t stored = model.levels[1].points.normals[0];
    EXPECT_NE(stored & kTwoSidedBit, 0);
    EXPECT_GT(normal_table()[stored & kNormalIndexMask][2], 0.999);
}

TEST(DetailLevels, ATwoSidedChildMakesItsAncestorsTwoSided) {
    const std::uint16_t up = quantise_normal(0, 0, 1);
    Model model = two_points(up, up | kTwoSidedBit);
    average_levels(model, 1);
    EXPECT_EQ(model.levels[1].points.normals[0], up | kTwoSidedBit);
    EXPECT_EQ(model.levels[0].points.normals[0], up | kTwoSidedBit);
}

TEST(DetailLevels, TheNumberOfThreadsChangesNothing) {
    for (const int depth : {2, 3, 6}) {
        Model one = test::sphere_model(depth, test::every_attribute(ColourFormat::rgb565, depth));
        Model many = one;
        average_levels(one, 1);
        average_levels(many, 8);
        EXPECT_EQ(one, many);
    }
}

} // namespace
} // namespace pbm
