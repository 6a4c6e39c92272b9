// Which texels of an image triangles show, beside tests of single places all over them.
#include "pbm_build/images/texture_pyramid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;

constexpr std::uint32_t kWidth = 24, kHeight = 16;

TextureCoverage coverage_of(const std::vector<TextureCorners> &triangles, Wrap wrap) {
    Texture image{.width = kWidth, .height = kHeight, .texels = {}, .use = {}};
    image.use.wrap = {wrap, wrap};
    TextureCoverage coverage(image);
    for (const TextureCorners &corners : triangles)
        coverage.add(corners);
    return coverage;
}

std::size_t texel_at(const glm::vec2 &place, Wrap wrap) {
    const auto at = [&](float part, std::uint32_t size) {
        return std::size_t{wrapped(static_cast<std::int64_t>(std::floor(part * static_cast<float>(size))), size, wrap)};
    };
    return at(place.y, kHeight) * kWidth + at(place.x, kWidth);
}

std::size_t covered(const TextureCoverage &coverage) {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < std::size_t{kWidth} * kHeight; ++i)
        sum += coverage.covers(i) ? 1 : 0;
    return sum;
}

TEST(TextureCoverage, HasAllPlacesOfTriangles) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> anywhere(-2.5F, 3.5F), part(0, 1);
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp, Wrap::mirror})
        for (int round = 0; round < 200; ++round) {
            std::vector<TextureCorners> triangles(3);
            const float size = round % 2 == 0 ? 1 : 0.1F;
            for (TextureCorners &corners : triangles) {
                const glm::vec2 middle(anywhere(random), anywhere(random));
                for (glm::vec2 &corner : corners)
                    corner = middle + size * glm::vec2(anywhere(random), anywhere(random));
            }
            const TextureCoverage coverage = coverage_of(triangles, wrap);
            for (const TextureCorners &corners : triangles)
                for (int i = 0; i < 300; ++i) {
                    const float a = part(random), b = part(random) * (1 - a);
                    const glm::vec2 place = a * corners[0] + b * corners[1] + (1 - a - b) * corners[2];
                    ASSERT_TRUE(coverage.covers(texel_at(place, wrap))) << place.x << " " << place.y;
                }
        }
}

TEST(TextureCoverage, AddsHalfATexelAroundATriangleAndNoMore) {
    const auto place = [](float x, float y) {
        return glm::vec2(x / static_cast<float>(kWidth), y / static_cast<float>(kHeight));
    };
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp, Wrap::mirror}) {
        const TextureCoverage small = coverage_of({{place(4.6F, 5.6F), place(7.4F, 5.6F), place(7.4F, 8.4F)}}, wrap);
        EXPECT_LE(covered(small), 16U);
        EXPECT_GE(covered(small), 6U);
        // Again and again, in other places of the same texels: nothing is added.
        std::vector<TextureCorners> tiles;
        for (int tile = -3; tile <= 3; ++tile)
            tiles.push_back({place(4.6F, 5.6F) + glm::vec2(tile, 2 * tile),
                             place(7.4F, 5.6F) + glm::vec2(tile, 2 * tile),
                             place(7.4F, 8.4F) + glm::vec2(tile, 2 * tile)});
        if (wrap == Wrap::repeat) {
            EXPECT_LE(covered(coverage_of(tiles, wrap)), 16U);
        }
    }
}

TEST(TextureCoverage, OfBothHalvesOfATileIsAll) {
    std::vector<TextureCorners> floor;
    for (int tile = 0; tile < 5; ++tile) {
        const auto x = static_cast<float>(tile);
        floor.push_back({glm::vec2(x, 0), glm::vec2(x + 1, 0), glm::vec2(x + 1, 1)});
        floor.push_back({glm::vec2(x, 0), glm::vec2(x + 1, 1), glm::vec2(x, 1)});
    }
    EXPECT_EQ(covered(coverage_of(floor, Wrap::repeat)), std::size_t{kWidth} * kHeight);
}

} // namespace
