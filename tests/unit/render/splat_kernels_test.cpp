#include "pbm_render/tables/splat_kernels.h"

#include "pbm_format/model/normal.h"
#include "unit/render/test_model.h"

#include <gtest/gtest.h>

#include <bit>

namespace pbm {
namespace {

constexpr int kSize = 200;
// An eye at distance 10 that looks along -Z; the object lies between 9 and 11.
struct Table {
    Projection projection{camera_in_front({0, 0, 0}, 10), kSize, kSize};
    SplatKernels kernels{projection, kSize, kSize, 9, 11};
};

int pixels_of(const SplatKernel &kernel) {
    int count = 0;
    for (const std::uint16_t row : kernel)
        count += std::popcount(row);
    return count;
}

// Pixels of a drawn disc, as rows of text.
std::vector<std::string> draw(const SplatKernels &kernels, glm::dvec3 normal, glm::vec2 pixel, float radius) {
    Framebuffer target(kSize, kSize);
    kernels.draw(quantise_normal(normal.x, normal.y, normal.z), pixel, 10, radius, 7, target);
    std::vector<std::string> rows(kSize, std::string(kSize, '.'));
    for (std::size_t i = 0; i < target.pixels(); ++i)
        if (target.depth[i] != kEmpty) {
            EXPECT_EQ(target.depth[i], 10);
            EXPECT_EQ(target.colour[i], 7U);
            rows[i / kSize][i % kSize] = '#';
        }
    return rows;
}

struct Extent {
    int width = 0, height = 0, count = 0;
};

Extent extent(const std::vector<std::string> &rows) {
    int left = kSize, right = -1, top = kSize, bottom = -1, count = 0;
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x)
            if (rows[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] == '#') {
                left = std::min(left, x), right = std::max(right, x), top = std::min(top, y),
                bottom = std::max(bottom, y);
                ++count;
            }
    return {right - left + 1, bottom - top + 1, count};
}

TEST(SplatKernels, ADiscSeenFromTheFrontFillsItsCircle) {
    const Table table;
    // Digits 3 3 3: normals near +z.
    const SplatKernel &front = table.kernels.kernel(0b111111);
    EXPECT_NEAR(pixels_of(front), 3.14159 * 64, 12);
    EXPECT_EQ(front[0] & 0x8001, 0); // corners are empty
}

TEST(SplatKernels, NoKernelIsEmptyAndNoneLeavesItsMiddleOut) {
    const Table table;
    for (std::size_t i = 0; i < kKernelCount; ++i) {
        EXPECT_GE(pixels_of(table.kernels.kernel(i)), 14) << i;
        EXPECT_NE((table.kernels.kernel(i)[7] | table.kernels.kernel(i)[8]) & 0b0000001110000000, 0) << i;
    }
}

TEST(SplatKernels, AnIndexIsMadeOfRegionDepthAndNormal) {
    const Table table;
    // At the right border of the picture discs that face right are flatter than in the middle.
    const std::size_t right = quantise_normal(1, 0.05, 0.6) >> 4 & 63;
    EXPECT_LT(pixels_of(table.kernels.kernel(1U << 8 | right)), pixels_of(table.kernels.kernel(right)));
    const std::size_t down = quantise_normal(0.05, 1, 0.6) >> 4 & 63;
    EXPECT_LT(pixels_of(table.kernels.kernel(1U << 9 | down)), pixels_of(table.kernels.kernel(down)));
}

TEST(SplatKernels, SizesGoUpInSteps) {
    const Table table;
    const auto wide = [&](float radius) { return extent(draw(table.kernels, {0, 0, 1}, {100.4F, 90.6F}, radius)); };
    EXPECT_EQ(wide(0.3F).count, 1);
    EXPECT_EQ(wide(1).count, 1);
    EXPECT_EQ(wide(1.01F).count, 9);
    EXPECT_EQ(wide(3).count, 9);
    EXPECT_EQ(wide(3.01F).width, 16);
    EXPECT_EQ(wide(8).width, 16);
    EXPECT_EQ(wide(8.01F).width, 32);
    EXPECT_EQ(wide(16.01F).width, 64);
    EXPECT_NEAR(wide(32).count, 3.14159 * 32 * 32, 200);
}

TEST(SplatKernels, DiscsLieAsTheirNormalSays) {
    const Table table;
    const Extent across = extent(draw(table.kernels, {1, 0, 0.5}, {100, 100}, 8));
    EXPECT_LT(across.width, 11);
    EXPECT_EQ(across.height, 16);
    const Extent along = extent(draw(table.kernels, {0, 1, 0.5}, {100, 100}, 8));
    EXPECT_EQ(along.width, 16);
    EXPECT_LT(along.height, 11);
    // A normal to the upper right: the disc is long from the upper left to the lower right.
    const auto slanted = draw(table.kernels, {1, 1, 0.7}, {100, 100}, 8);
    EXPECT_EQ(slanted[95][95], '#');
    EXPECT_EQ(slanted[104][104], '#');
    EXPECT_EQ(slanted[95][104], '.');
    EXPECT_EQ(slanted[104][95], '.');
    // To the upper left it is its mirror image.
    const auto mirrored = draw(table.kernels, {-1, 1, 0.7}, {100, 100}, 8);
    for (std::size_t y = 0; y < kSize; ++y)
        EXPECT_EQ(std::string(mirrored[y].rbegin(), mirrored[y].rend()), slanted[y]);
}

TEST(SplatKernels, PixelsOutsideAreClipped) {
    const Table table;
    EXPECT_EQ(extent(draw(table.kernels, {0, 0, 1}, {-50, 20}, 8)).count, 0);
    EXPECT_EQ(extent(draw(table.kernels, {0, 0, 1}, {-1e30F, 1e30F}, 8)).count, 0);
    const Extent corner = extent(draw(table.kernels, {0, 0, 1}, {0, 0}, 8));
    EXPECT_EQ(corner.width, 8);
    EXPECT_EQ(corner.height, 8);
    EXPECT_EQ(extent(draw(table.kernels, {0, 0, 1}, {100, 100}, 1e9F)).count, kSize * kSize);
}

TEST(SplatKernels, NearerDiscsHideFartherOnes) {
    const Table table;
    Framebuffer target(kSize, kSize);
    const std::size_t normal = quantise_normal(0, 0, 1);
    table.kernels.draw(normal, {100, 100}, 10, 8, 1, target);
    table.kernels.draw(normal, {104, 100}, 9.5F, 8, 2, target);
    table.kernels.draw(normal, {96, 100}, 10.5F, 8, 3, target);
    EXPECT_EQ(target.colour[100 * kSize + 104], 2U);
    EXPECT_EQ(target.colour[100 * kSize + 95], 1U);
    EXPECT_EQ(target.colour[100 * kSize + 89], 3U);
}

} // namespace
} // namespace pbm
