// Which pixels get more than one sample, and what the others show.
#include "pbm_render/fine/sample_sums.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {
namespace {

constexpr int kSumsWidth = 150, kSumsHeight = 9;

template <class Light> SampleSums sums_of(const Light &light, Float4 behind = Float4{}) {
    SampleSums sums;
    sums.begin(kSumsWidth, kSumsHeight);
    for (int y = 0; y < kSumsHeight; ++y)
        for (int x = 0; x < kSumsWidth; ++x)
            sums.row(y)[static_cast<std::size_t>(x)] = light(x, y);
    sums.begin_choice(false);
    for (int y = 0; y < kSumsHeight; y += 3) // strips
        sums.choose(y, y + 3, [&](int) { return behind; });
    return sums;
}

std::vector<std::vector<Float4>> means_of(const SampleSums &sums, int samples) {
    std::vector<std::vector<Float4>> rows;
    sums.for_each_row(0, kSumsHeight, samples,
                      [&](int, std::span<const Float4> row) { rows.emplace_back(row.begin(), row.end()); });
    return rows;
}

Float4 grey(float light) { return Float4{light, light, light, 1}; }

TEST(SampleSums, CorrectsTheCentresOfPixelsByTheCurvature) {
    const auto light = [](double x, double y) { return 0.3 + 0.002 * x + 0.004 * (y - 4) * (y - 4); };
    const SampleSums sums = sums_of([&](int x, int y) { return grey(static_cast<float>(light(x, y))); });
    const auto means = means_of(sums, 8);
    for (int y = 1; y < kSumsHeight - 1; ++y)
        for (int x = 1; x < kSumsWidth - 1; ++x) {
            ASSERT_FALSE(sums.chosen().has(x, y));
            // The mean of 0.004 y^2 over an edge of 1 around y is 0.004 (y^2 + 1 / 12).
            ASSERT_NEAR(means[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)][0], light(x, y) + 0.004 / 12,
                        1e-6);
        }
}

TEST(SampleSums, ChoosesBothSidesOfABorder) {
    constexpr int kBorder = 64; // that of two words
    for (const float contrast : {0.05F, 0.9F}) {
        SampleSums sums = sums_of([&](int x, int) { return grey(x < kBorder ? 0.04F : 0.04F + contrast); });
        for (int y = 0; y < kSumsHeight; ++y)
            for (int x = 0; x < kSumsWidth; ++x)
                ASSERT_EQ(sums.chosen().has(x, y), x == kBorder - 1 || x == kBorder) << x << " " << y;
        sums.row(2)[kBorder] += grey(0) + grey(0) + grey(0);
        const auto means = means_of(sums, 4);
        EXPECT_FLOAT_EQ(means[2][kBorder][0], (0.04F + contrast) / 4);
        EXPECT_FLOAT_EQ(means[2][kBorder][3], 1);
    }
}

TEST(SampleSums, ChoosesTheOutlineOfAnObject) {
    const auto is_object = [](int x, int y) { return x >= 20 && y >= 5; };
    const Float4 behind{0.5F, 0.5F, 0.5F, 1}; // of the same colour as the object
    const SampleSums sums = sums_of([&](int x, int y) { return is_object(x, y) ? grey(0.5F) : Float4{}; }, behind);
    for (int y = 0; y < kSumsHeight; ++y)
        for (int x = 0; x < kSumsWidth; ++x) {
            bool differs = false;
            for (int v = std::max(y - 1, 0); v <= std::min(y + 1, kSumsHeight - 1); ++v)
                for (int u = std::max(x - 1, 0); u <= std::min(x + 1, kSumsWidth - 1); ++u)
                    differs |= is_object(u, v) != is_object(x, y);
            ASSERT_EQ(sums.chosen().has(x, y), differs) << x << " " << y;
        }
}

TEST(SampleSums, ChoosesNothingWhereThePictureIsEmpty) {
    const SampleSums sums = sums_of([](int, int) { return Float4{}; }, Float4{0.2F, 0.3F, 0.4F, 1});
    for (int y = 0; y < kSumsHeight; ++y)
        for_each_bit(sums.chosen().row(y), [&](int x) { ADD_FAILURE() << x << " " << y; });
    for (const auto &row : means_of(sums, 8))
        for (const Float4 mean : row)
            ASSERT_EQ(mean[3], 0);
}

TEST(ChosenCounts, CountsThePixelsAboveAndLeft) {
    PixelBits chosen;
    chosen.resize(kSumsWidth, 40);
    for (int y = 0; y < 40; ++y)
        std::fill(chosen.row(y).begin(), chosen.row(y).end(), 0);
    constexpr int kX = 66, kY = 12, kTop = 10, kBottom = 30;
    chosen.row(kY)[kX / PixelBits::kBits] |= std::uint64_t{1} << (kX % PixelBits::kBits);
    chosen.row(kTop - 1)[0] = chosen.row(kBottom)[0] = 1; // outside the strip
    ChosenCounts counts;
    counts.begin(chosen, kSumsWidth, kTop, kBottom);
    EXPECT_EQ(counts.width(), kSumsWidth);
    for (int y = kTop; y <= kBottom; ++y)
        for (int x = 0; x <= kSumsWidth; ++x)
            ASSERT_EQ(counts.above_left()[(y - kTop) * counts.stride() + x], x > kX && y > kY) << x << " " << y;
    const auto touches = [&](int left, int right, int top, int bottom) {
        VisibleBrick brick{};
        brick.left = left;
        brick.right = right;
        brick.top = top;
        brick.bottom = bottom;
        return counts.touch(brick);
    };
    EXPECT_TRUE(touches(0, kSumsWidth, 0, 40));
    EXPECT_TRUE(touches(kX + 1, kX + 2, kY + 1, kY + 2)); // the outermost sample of the pixel beside it
    EXPECT_TRUE(touches(kX - 1, kX, kY - 1, kY));
    EXPECT_FALSE(touches(kX + 2, kX + 3, kY, kY + 1));
    EXPECT_FALSE(touches(kX, kX + 1, kY + 2, kY + 3));
    EXPECT_FALSE(touches(0, 1, 0, 40)); // those outside the strip do not count
    EXPECT_FALSE(touches(kX, kX + 1, 40, 50));
}

TEST(SampledPixels, NumbersThePixelsOfSomeRows) {
    constexpr int kColumns = 128;
    PixelBits chosen;
    chosen.resize(kColumns, 4);
    for (int y = 0; y < 4; ++y)
        for (std::uint64_t &word : chosen.row(y))
            word = 0x8100'0000'0000'0081U; // four pixels in each word
    ChosenCounts counts;
    counts.begin(chosen, kColumns, 1, 3);
    SampledPixels pixels;
    pixels.begin(counts, 1, 1);
    EXPECT_EQ(pixels.bottom, 3);
    EXPECT_EQ(pixels.count, 16U);
    const auto numbers = [&](int left, int right, int top, int bottom) {
        std::vector<std::size_t> all;
        pixels.for_each_in_box(left, right, top, bottom, [&](int x, int, std::size_t pixel) {
            EXPECT_TRUE(x % 64 == 0 || x % 64 == 7 || x % 64 == 56 || x % 64 == 63) << x;
            all.push_back(pixel);
        });
        return all;
    };
    std::vector<std::size_t> all = numbers(0, kColumns, 1, 3); // word by word, row after row in each
    std::sort(all.begin(), all.end());
    ASSERT_EQ(all.size(), 16U);
    for (std::size_t i = 0; i < all.size(); ++i)
        EXPECT_EQ(all[i], i);
    EXPECT_EQ(numbers(7, 64, 2, 3), (std::vector<std::size_t>{9, 10, 11}));
    EXPECT_EQ(numbers(63, 65, 1, 2), (std::vector<std::size_t>{3, 4}));
    EXPECT_EQ(numbers(8, 56, 1, 3), std::vector<std::size_t>{});
}

} // namespace
} // namespace pbm
