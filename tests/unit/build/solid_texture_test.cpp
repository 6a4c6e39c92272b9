// Marble and wood: the same bytes on every processor, invariant to placement, free of aliasing.
#include "pbm_build/texture/solid_texture.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace pbm::build {
namespace {

constexpr std::array kKinds{TextureKind::marble, TextureKind::wood};

SolidTexture texture_of(TextureKind kind, std::uint32_t seed = 0, std::optional<float> scale = std::nullopt) {
    auto texture = make_texture({.kind = kind, .seed = seed, .scale = scale});
    EXPECT_TRUE(texture.ok());
    return *texture;
}

Grid grid_of(int depth, UpAxis up = UpAxis::y) {
    return {.depth = depth, .origin = {}, .voxel_size = 1.0 / static_cast<double>(1 << depth), .up = up};
}

// Voxels of a block, in Morton order.
std::vector<MortonCode> block_of(std::uint32_t edge, std::uint32_t corner = 0) {
    std::vector<MortonCode> codes;
    for (std::uint32_t z = 0; z < edge; ++z)
        for (std::uint32_t y = 0; y < edge; ++y)
            for (std::uint32_t x = 0; x < edge; ++x)
                codes.push_back(morton_encode(corner + x, corner + y, corner + z));
    std::sort(codes.begin(), codes.end());
    return codes;
}

Bytes values_of(const SolidTexture &texture, const Grid &grid, const std::vector<MortonCode> &codes, int threads = 2) {
    Bytes values(codes.size());
    evaluate_texture(texture, grid, codes, values, threads);
    return values;
}

double mean_of(const Bytes &values) {
    double sum = 0;
    for (const std::uint8_t value : values)
        sum += value;
    return sum / static_cast<double>(values.size());
}
double deviation_of(const Bytes &values) {
    const double mean = mean_of(values);
    double sum = 0;
    for (const std::uint8_t value : values)
        sum += (value - mean) * (value - mean);
    return std::sqrt(sum / static_cast<double>(values.size()));
}
double mean_difference(const Bytes &a, const Bytes &b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        sum += std::abs(a[i] - b[i]);
    return sum / static_cast<double>(a.size());
}

std::uint64_t fnv1a(const Bytes &bytes) {
    std::uint64_t hash = 0xCBF29CE484222325;
    for (const std::uint8_t byte : bytes)
        hash = (hash ^ byte) * 0x100000001B3;
    return hash;
}

// The same for every compiler and machine.
TEST(SolidTexture, HasItsGoldenBytes) {
    const auto codes = block_of(40, 300);
    EXPECT_EQ(fnv1a(values_of(texture_of(TextureKind::marble, 9), grid_of(10), codes, 1)), 10687687333970815924U);
    EXPECT_EQ(fnv1a(values_of(texture_of(TextureKind::wood, 9), grid_of(10), codes, 1)), 17584181791200229280U);
}

TEST(SolidTexture, SameBytesFromEveryProcessorAndThreadCount) {
    const auto codes = block_of(40, 300);
    for (const TextureKind kind : kKinds) {
        const SolidTexture texture = texture_of(kind, 9);
        const Bytes expected = values_of(texture, grid_of(10), codes, 1);
        for (const int threads : {1, 2, 5})
            EXPECT_EQ(values_of(texture, grid_of(10), codes, threads), expected) << threads;
        for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
            hwy::SetSupportedTargetsForTest(targets & -targets);
            EXPECT_EQ(values_of(texture, grid_of(10), codes, 1), expected) << hwy::TargetName(targets & -targets);
        }
        hwy::SetSupportedTargetsForTest(0);
    }
}

TEST(SolidTexture, AnyPartOfThePointsHasTheSameValues) {
    const auto codes = block_of(16, 64);
    for (const TextureKind kind : kKinds) {
        const Bytes all = values_of(texture_of(kind), grid_of(8), codes);
        const std::vector<MortonCode> some(codes.begin() + 1111, codes.begin() + 2222);
        EXPECT_EQ(values_of(texture_of(kind), grid_of(8), some), Bytes(all.begin() + 1111, all.begin() + 2222));
    }
    EXPECT_TRUE(values_of(texture_of(TextureKind::wood), grid_of(8), {}).empty());
}

TEST(SolidTexture, SeedsDifferInPlacesNotInKind) {
    const auto codes = block_of(64);
    for (const TextureKind kind : kKinds) {
        const Bytes one = values_of(texture_of(kind, 1), grid_of(6), codes);
        const Bytes two = values_of(texture_of(kind, 2), grid_of(6), codes);
        EXPECT_GT(mean_difference(one, two), 5);
        EXPECT_NEAR(mean_of(one), mean_of(two), 25);
        EXPECT_GT(deviation_of(one), 12);
    }
}

TEST(SolidTexture, UsesThePalette) {
    for (const TextureKind kind : kKinds) {
        std::array<std::size_t, 256> counts{};
        for (std::uint32_t seed = 0; seed < 4; ++seed)
            for (const std::uint8_t value : values_of(texture_of(kind, seed), grid_of(9), block_of(64, 100 * seed)))
                ++counts[value];
        EXPECT_GE(std::count_if(counts.begin(), counts.end(), [](std::size_t count) { return count > 3; }), 100);
        EXPECT_LT(counts[0] + counts[255], 4 * 64 * 64 * 64 / 20); // few values are clamped
    }
}

TEST(SolidTexture, IsOfTheGridNotOfItsUnits) {
    const auto codes = block_of(16, 40);
    Grid far = grid_of(7);
    far.origin = {4.5e6, -1e7, 12};
    far.voxel_size = 37.5;
    for (const TextureKind kind : kKinds)
        EXPECT_EQ(values_of(texture_of(kind), far, codes), values_of(texture_of(kind), grid_of(7), codes));
}

TEST(SolidTexture, FollowsTheUpAxis) {
    std::vector<MortonCode> y_up, z_up, x_up;
    for (std::uint32_t u = 0; u < 20; ++u)
        for (std::uint32_t v = 0; v < 20; ++v)
            for (std::uint32_t up = 0; up < 20; ++up) {
                y_up.push_back(morton_encode(v, up, u)); // cyclic order x, y, z: up, u, v
                z_up.push_back(morton_encode(u, v, up));
                x_up.push_back(morton_encode(up, u, v));
            }
    for (const TextureKind kind : kKinds) {
        const Bytes expected = values_of(texture_of(kind), grid_of(5), y_up);
        EXPECT_EQ(values_of(texture_of(kind), grid_of(5, UpAxis::z), z_up), expected);
        EXPECT_EQ(values_of(texture_of(kind), grid_of(5, UpAxis::x), x_up), expected);
    }
}

// The mean of a voxel's eight children is close to its own value.
TEST(SolidTexture, LooksAlikeAtEveryDepth) {
    for (const TextureKind kind : kKinds) {
        // At this size both depths resolve the finest fibres.
        const SolidTexture texture = texture_of(kind, 0, kind == TextureKind::wood ? 5.0F : 4.0F);
        const Bytes coarse = values_of(texture, grid_of(9), block_of(32, 200));
        const Bytes fine = values_of(texture, grid_of(10), block_of(64, 400));
        Bytes averages(coarse.size());
        for (std::size_t i = 0; i < fine.size(); i += 8) {
            int sum = 0;
            for (std::size_t child = 0; child < 8; ++child)
                sum += fine[i + child];
            averages[i / 8] = static_cast<std::uint8_t>((sum + 4) / 8);
        }
        EXPECT_LT(mean_difference(coarse, averages), 4) << static_cast<int>(kind);
        EXPECT_NEAR(mean_of(coarse), mean_of(averages), 1.5);
    }
}

// Veins and rings finer than voxels fade out instead of aliasing.
TEST(SolidTexture, DetailFinerThanAVoxelFadesAway) {
    for (const TextureKind kind : kKinds)
        EXPECT_LT(deviation_of(values_of(texture_of(kind, 0, 1000), grid_of(6), block_of(64))), 3)
            << static_cast<int>(kind);
}

TEST(SolidTexture, NumbersOfFilesAreClampedToTheirRange) {
    for (const TextureKind kind : kKinds) {
        SolidTexture wild = texture_of(kind), tame = wild;
        wild.scale = 1e9F;
        wild.turbulence = 1e6F;
        tame.scale = kMaxTextureScale;
        tame.turbulence = kMaxTurbulence;
        EXPECT_EQ(values_of(wild, grid_of(8), block_of(16)), values_of(tame, grid_of(8), block_of(16)));
        GroundPlane vast{.centre = {1e30F, -1e30F, 0}, .half_edge = 1e20F, .material = 0, .texture = wild};
        EXPECT_EQ(evaluate_ground_texture(wild, grid_of(8), vast, 33, 1).texels.size(), 33U * 33);
    }
}

TEST(SolidTexture, RefusesImpossibleParameters) {
    const auto refused = [](const TextureOptions &options) {
        const auto texture = make_texture(options);
        return !texture.ok() && texture.error().code == ErrorCode::usage;
    };
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    for (const float scale : {0.0F, -1.0F, 0.001F, 1001.0F, kNan})
        EXPECT_TRUE(refused({.scale = scale})) << scale;
    for (const float turbulence : {-0.1F, 101.0F, kNan})
        EXPECT_TRUE(refused({.turbulence = turbulence})) << turbulence;
    EXPECT_TRUE(refused({.kind = TextureKind::wood, .colours = "carrara"}));
    EXPECT_FALSE(refused({.kind = TextureKind::wood, .colours = "walnut", .scale = 3.0F}));
    EXPECT_EQ(texture_kind("wood"), TextureKind::wood);
    EXPECT_EQ(texture_kind("Marble"), std::nullopt);
}

TEST(GroundTexture, MarbleIsASliceOfTheSolid) {
    const SolidTexture marble = texture_of(TextureKind::marble, 4);
    for (const UpAxis up : {UpAxis::y, UpAxis::z, UpAxis::x}) {
        const Grid grid = grid_of(6, up);
        const std::size_t axis = up == UpAxis::y ? 1 : up == UpAxis::z ? 2 : 0;
        GroundPlane ground{.centre = {0.5F, 0.5F, 0.5F}, .half_edge = 0.5F, .texture = {}};
        ground.centre[axis] = 10.5F / 64;
        const Image image = evaluate_ground_texture(marble, grid, ground, 64, 3);
        std::vector<MortonCode> codes;
        for (std::uint32_t v = 0; v < 64; ++v)
            for (std::uint32_t u = 0; u < 64; ++u) {
                std::array<std::uint32_t, 3> place{};
                place[axis] = 10;
                place[(axis + 1) % 3] = u;
                place[(axis + 2) % 3] = v;
                codes.push_back(morton_encode(place[0], place[1], place[2]));
            }
        EXPECT_EQ(image.texels, values_of(marble, grid, codes));
    }
}

Image floor_of_wood(int threads) {
    const GroundPlane ground{.centre = {0.5F, 0, 0.5F}, .half_edge = 1.5F, .texture = {}};
    return evaluate_ground_texture(texture_of(TextureKind::wood), grid_of(10), ground, 1000, threads);
}

TEST(GroundTexture, SameTexelsForAnyNumberOfThreads) { EXPECT_EQ(floor_of_wood(1).texels, floor_of_wood(6).texels); }

TEST(GroundTexture, HasItsGoldenTexels) { EXPECT_EQ(fnv1a(floor_of_wood(2).texels), 10057949503685746772U); }

TEST(GroundTexture, WoodIsAFloorOfBoards) {
    const Image floor = floor_of_wood(2);
    const auto row_mean = [&](std::size_t y) {
        return mean_of(Bytes(floor.texels.begin() + static_cast<std::ptrdiff_t>(y * 1000),
                             floor.texels.begin() + static_cast<std::ptrdiff_t>((y + 1) * 1000)));
    };
    for (std::size_t seam = 100; seam < 1000; seam += 100) { // ten boards; seams have late wood
        EXPECT_GT(row_mean(seam), 180);
        EXPECT_LT(row_mean(seam - 50), 130);
    }
}

} // namespace
} // namespace pbm::build
