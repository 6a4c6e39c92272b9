// Tiles of the farthest depths: nothing that a pixel shows is taken for hidden, and what is deep inside is found.
#include "pbm_render/splats/farthest_depths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace pbm {
namespace {

constexpr int kTileWidth = 45, kTileTop = 10, kTileBottom = 31; // no whole number of tiles

// A strip whose pixels have depths of 1 to 2; a few show nothing.
DepthStrip random_strip() {
    std::mt19937 random(7);
    DepthStrip strip;
    strip.begin(kTileWidth, kTileTop, kTileBottom);
    for (int y = kTileTop; y < kTileBottom; ++y)
        for (int x = 0; x < kTileWidth; ++x)
            if (random() % 50 != 0)
                strip.pixels[static_cast<std::size_t>(strip.offset(x, y))] = DepthStrip::pixel(
                    1 + static_cast<float>(random() % 1000) / 1000, static_cast<std::uint32_t>(random() % 100));
    return strip;
}

float farthest_in(const DepthStrip &strip, const FarthestDepths::Box &box) {
    float farthest = 0;
    for (int y = std::max(box.top, kTileTop); y < std::min(box.bottom, kTileBottom); ++y)
        for (int x = std::max(box.left, 0); x < std::min(box.right, kTileWidth); ++x)
            farthest = std::max(farthest, strip.depth(x, y));
    return farthest;
}

// The box widened to whole tiles of `edge` columns and `rows` rows.
FarthestDepths::Box in_tiles(const FarthestDepths::Box &box, int edge, int rows) {
    const auto down = [](int v, int step) { return v < 0 ? 0 : v / step * step; };
    const auto up = [](int v, int step) { return (v + step - 1) / step * step; };
    return {down(box.left, edge), up(box.right, edge), kTileTop + down(box.top - kTileTop, rows),
            kTileTop + up(box.bottom - kTileTop, rows)};
}

TEST(FarthestDepths, HideWhatLiesBehindAllPixelsOfItsTiles) {
    const DepthStrip strip = random_strip();
    FarthestDepths farthest;
    farthest.begin(strip);
    std::mt19937 random(8);
    int hidden = 0;
    for (int i = 0; i < 20000; ++i) {
        const int left = static_cast<int>(random() % 60) - 8, top = static_cast<int>(random() % 36);
        const FarthestDepths::Box box{left, left + 1 + static_cast<int>(random() % 6), top,
                                      top + 1 + static_cast<int>(random() % 6)};
        const float nearest = 1.9F + static_cast<float>(random() % 1000) / 5000;
        const bool is_beside =
            box.right <= 0 || box.left >= kTileWidth || box.bottom <= kTileTop || box.top >= kTileBottom;
        EXPECT_EQ(farthest.hide(box, nearest), is_beside || nearest > farthest_in(strip, in_tiles(box, 4, 4)));
        hidden += !is_beside && farthest.hide(box, nearest);
        VisibleBrick brick{};
        brick.left = std::max(box.left, 0);
        brick.right = std::min(box.right, kTileWidth);
        brick.top = box.top;
        brick.bottom = box.bottom;
        brick.nearest = nearest;
        EXPECT_EQ(farthest.hide(brick), is_beside || nearest > farthest_in(strip, in_tiles(box, 16, 8)));
    }
    EXPECT_GT(hidden, 100);
}

} // namespace
} // namespace pbm
