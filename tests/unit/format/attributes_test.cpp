#include "pbm_format/model/normal.h"
#include "pbm_format/model/point_values.h"

#include "unit/support/test_models.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace pbm {
namespace {

// Rule 6.1.3 in its own words: the best of all 8,192, ties to the lowest index.
std::uint16_t nearest_of_all(double x, double y, double z) {
    std::uint16_t best = 0;
    double best_score = -HUGE_VAL;
    for (std::size_t i = 0; i < kNormalCount; ++i) {
        const UnitVector &n = normal_table()[i];
        const double score = (x * n[0] + y * n[1]) + z * n[2];
        if (score > best_score) {
            best_score = score;
            best = static_cast<std::uint16_t>(i);
        }
    }
    return best;
}

TEST(Normal, TheTableHasUnitVectorsInTheRightOctant) {
    std::set<IntegerNormal> seen;
    for (std::size_t i = 0; i < kNormalCount; ++i) {
        const UnitVector &n = normal_table()[i];
        EXPECT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-15);
        for (std::size_t axis = 0; axis < 3; ++axis)
            EXPECT_EQ(n[axis] < 0, (i >> (10 + axis) & 1) != 0);
        seen.insert(integer_normal_table()[i]);
    }
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(kNormalCount));
}

TEST(Normal, LiteralEntriesOfTheSpecification) {
    // Index 0: the middle triangle of the middle triangle ...: centroid (1, 1, 1) / 3.
    EXPECT_EQ(integer_normal_table()[0], (IntegerNormal{18918, 18918, 18918}));
    EXPECT_EQ(integer_normal_table()[0x1C00], (IntegerNormal{-18918, -18918, -18918}));
    // Five times digit 1: the triangle at the x corner, centroid (94, 1, 1) / 3.
    EXPECT_EQ(integer_normal_table()[0x155], (IntegerNormal{32763, 349, 349}));
}

TEST(Normal, EveryEntryQuantisesToItself) {
    for (std::size_t i = 0; i < kNormalCount; ++i) {
        const UnitVector &n = normal_table()[i];
        EXPECT_EQ(quantise_normal(n[0], n[1], n[2]), i);
    }
}

TEST(Normal, RandomDirectionsFindTheNearestOfAll) {
    test::Random random(11);
    for (int i = 0; i < 20000; ++i) {
        const double x = 2 * random.unit() - 1, y = 2 * random.unit() - 1, z = 2 * random.unit() - 1;
        EXPECT_EQ(quantise_normal(x, y, z), nearest_of_all(x, y, z)) << x << ' ' << y << ' ' << z;
    }
}

TEST(Normal, TiesGoToTheLowestIndex) {
    for (const double x : {-1.0, 0.0, 1.0})
        for (const double y : {-1.0, 0.0, 1.0})
            for (const double z : {-1.0, 0.0, 1.0})
                if (x != 0 || y != 0 || z != 0) {
                    EXPECT_EQ(quantise_normal(x, y, z), nearest_of_all(x, y, z)) << x << ' ' << y << ' ' << z;
                }
    EXPECT_EQ(quantise_normal(0, 0, 0), 0);
    // Directions on the borders between octants and between triangles.
    for (int i = 0; i <= 64; ++i) {
        const double t = i / 64.0;
        EXPECT_EQ(quantise_normal(t, 1 - t, 0), nearest_of_all(t, 1 - t, 0));
        EXPECT_EQ(quantise_normal(0, -t, 1 - t), nearest_of_all(0, -t, 1 - t));
        EXPECT_EQ(quantise_normal(t / 2, t / 2, 1 - t), nearest_of_all(t / 2, t / 2, 1 - t));
    }
}

TEST(Normal, QuantisationIsWithinTwoDegrees) {
    test::Random random(12);
    double worst = 1;
    for (int i = 0; i < 20000; ++i) {
        const double x = 2 * random.unit() - 1, y = 2 * random.unit() - 1, z = 2 * random.unit() - 1;
        const double length = std::sqrt(x * x + y * y + z * z);
        const UnitVector &n = normal_table()[quantise_normal(x, y, z)];
        worst = std::min(worst, (x * n[0] + y * n[1] + z * n[2]) / length);
    }
    EXPECT_GT(worst, std::cos(2.6 * 3.14159265 / 180));
}

TEST(Colour, LinearTableEndsAndInverse) {
    EXPECT_EQ(linear_table()[0], 0);
    EXPECT_EQ(linear_table()[1], 20);
    EXPECT_EQ(linear_table()[128], 14146);
    EXPECT_EQ(linear_table()[255], 65535);
    for (std::size_t i = 0; i < 256; ++i)
        EXPECT_EQ(linear_to_srgb(linear_table()[i]), i);
    EXPECT_EQ(linear_to_srgb(10), 0); // half way between 0 and 20: the lower one
    EXPECT_EQ(linear_to_srgb(11), 1);
    EXPECT_EQ(linear_to_srgb(1000000), 255);
}

// BVG.md 6.3.2. There are no ties, since 255 is odd.
TEST(Colour, EveryValuePacksToTheNearestOf5And6Bits) {
    for (int value = 0; value < 256; ++value) {
        const auto byte = static_cast<std::uint8_t>(value);
        const std::uint16_t packed = pack_565({byte, byte, byte});
        const int red = packed >> 11, green = packed >> 5 & 63, blue = packed & 31;
        EXPECT_LE(2 * std::abs(255 * red - 31 * value), 255) << value;
        EXPECT_LE(2 * std::abs(255 * green - 63 * value), 255) << value;
        EXPECT_EQ(blue, red);
    }
}

TEST(Colour, EveryPacked565SurvivesExpansion) {
    for (unsigned packed = 0; packed < 65536; ++packed)
        EXPECT_EQ(pack_565(expand_565(static_cast<std::uint16_t>(packed))), packed);
    EXPECT_EQ(expand_565(0xF800), (Rgb8{255, 0, 0}));
    EXPECT_EQ(expand_565(0x07E0), (Rgb8{0, 255, 0}));
    EXPECT_EQ(expand_565(0x001F), (Rgb8{0, 0, 255}));
}

TEST(Radius, TwelveStepsAreOneOctaveAndTheLastIsTheEdge) {
    EXPECT_EQ(radius_fixed(255), std::uint64_t{1} << 40);
    EXPECT_EQ(radius_fixed(243), std::uint64_t{1} << 39);
    EXPECT_EQ(radius_fixed(3), std::uint64_t{1} << 19);
    EXPECT_EQ(radius_fixed(254), 1037800781952U);
    for (int i = 0; i < 256; ++i) {
        const auto index = static_cast<std::uint8_t>(i);
        EXPECT_NEAR(radius_fraction(index), std::exp2((i - 255) / 12.0), 0x1p-39);
        EXPECT_EQ(radius_index(radius_fraction(index)), index);
        if (i < 255) {
            EXPECT_EQ(radius_index(std::nextafter(radius_fraction(index), 1.0)), i + 1) << "what it does not cover";
        }
    }
    EXPECT_LE(radius_fraction(kMaxFinestRadius), 0.05);
    EXPECT_GT(radius_fraction(kMaxFinestRadius + 1), 0.05);
}

TEST(Radius, CoarserPointsCoverTheirChildren) {
    for (int level = 0; level < kMaxDepth; ++level)
        for (int child = 0; child < 240; ++child) {
            const auto index = static_cast<std::uint8_t>(child);
            const double needed = radius_fraction(index) + std::sqrt(3.0) / 4 * std::exp2(-level);
            const std::uint8_t covering = covering_radius(index, level);
            if (needed > 1) {
                EXPECT_EQ(covering, 255);
                continue;
            }
            EXPECT_GE(radius_fraction(covering), needed - 1e-9);
            if (covering > 0) {
                EXPECT_LT(radius_fraction(static_cast<std::uint8_t>(covering - 1)), needed + 1e-9);
            }
        }
    // Dense samples keep their class, 0.89 voxels, at every level.
    for (int level = 3; level < kMaxDepth; ++level)
        EXPECT_EQ(covering_radius(static_cast<std::uint8_t>(253 - 12 * (level + 1)), level), 253 - 12 * level);
}

} // namespace
} // namespace pbm
