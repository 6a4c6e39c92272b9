#include "pbm_render/shading/depth_cue.h"
#include "unit/render/test_model.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>

namespace pbm {
namespace {

constexpr int kWidth = 160, kHeight = 120;
constexpr double kFocal = 200, kEdge = 100;
constexpr std::uint32_t kGrey = 0xFFC0C0C0;

// A grey picture with the given depths.
Framebuffer picture(const std::function<double(int, int)> &depth) {
    Framebuffer target(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            const auto at = static_cast<std::size_t>(std::ptrdiff_t{y} * kWidth + x);
            target.depth[at] = static_cast<float>(depth(x, y));
            target.colour[at] = kGrey;
        }
    return target;
}

Framebuffer darkened(DepthCue cue, const std::function<double(int, int)> &depth, int threads = 1,
                     const DepthCueView &view = {kFocal, kEdge}) {
    Framebuffer target = picture(depth);
    ThreadPool pool(threads);
    apply_depth_cue(cue, view, pool, target);
    return target;
}

int grey(const Framebuffer &target, int x, int y) {
    return static_cast<int>(target.colour[static_cast<std::size_t>(std::ptrdiff_t{y} * kWidth + x)] & 255);
}

// A wall at depth 104 and a box in front of it, 4 deep.
double box(int x, int y) { return x >= 60 && x < 100 && y >= 40 && y < 80 ? 100 : 104; }

class DepthCues : public testing::TestWithParam<DepthCue> {};

TEST_P(DepthCues, AWallStaysAsItIs) {
    const Framebuffer wall = darkened(GetParam(), [](int, int) { return 100.0; });
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            EXPECT_NEAR(grey(wall, x, y), 0xC0, 1);
}

TEST_P(DepthCues, TheFootOfABoxIsDarkItsTopIsNot) {
    const Framebuffer target = darkened(GetParam(), box);
    EXPECT_LT(grey(target, 58, 60), 0xC0 - 25);
    EXPECT_LT(grey(target, 80, 38), 0xC0 - 25);
    EXPECT_NEAR(grey(target, 80, 60), 0xC0, 1); // the middle of the top
    EXPECT_GT(grey(target, 61, 60), 0xC0 - 6);  // its border
    EXPECT_NEAR(grey(target, 10, 10), 0xC0, 1); // far away
}

TEST_P(DepthCues, EmptyPixelsStayAndCastNothing) {
    const Framebuffer target = darkened(GetParam(), [](int x, int) { return x < 80 ? 100.0 : kEmpty; });
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            EXPECT_NEAR(grey(target, x, y), 0xC0, x < 80 ? 1 : 0);
}

TEST_P(DepthCues, TransparencyAndDepthsStay) {
    Framebuffer target = picture(box);
    target.colour[40 * kWidth + 58] = 0x40C0C0C0;
    const auto depths = target.depth;
    ThreadPool pool(1);
    apply_depth_cue(GetParam(), {kFocal, kEdge}, pool, target);
    EXPECT_EQ(target.colour[40 * kWidth + 58] >> 24, 0x40U);
    EXPECT_TRUE(std::equal(depths.begin(), depths.end(), target.depth.begin()));
}

TEST_P(DepthCues, ThreadsDoNotMatter) {
    const auto waves = [](int x, int y) { return 100 + 3 * std::sin(x * 0.2) * std::cos(y * 0.3); };
    const Framebuffer one = darkened(GetParam(), waves), four = darkened(GetParam(), waves, 4);
    EXPECT_TRUE(std::equal(one.colour.begin(), one.colour.begin() + static_cast<std::ptrdiff_t>(one.pixels()),
                           four.colour.begin()));
}

// The same scene from a hundred times as far away, as an orthographic camera draws it.
TEST_P(DepthCues, ReliefMakesUpForADistantEye) {
    const Framebuffer near = darkened(GetParam(), box);
    const auto far_box = [](int x, int y) { return box(x, y) + 99 * 100; };
    const Framebuffer far =
        darkened(GetParam(), far_box, 1, {.focal = 100 * kFocal, .grid_edge = kEdge, .relief = 100});
    for (const auto &[x, y] : {std::pair(58, 60), std::pair(80, 38), std::pair(80, 60), std::pair(61, 60)})
        EXPECT_NEAR(grey(far, x, y), grey(near, x, y), 8) << x << ", " << y;
}

INSTANTIATE_TEST_SUITE_P(All, DepthCues, testing::Values(DepthCue::eye_dome, DepthCue::ambient_occlusion));

TEST(DepthCue, NoneChangesNothing) {
    const Framebuffer target = darkened(DepthCue::none, box);
    EXPECT_EQ(grey(target, 58, 60), 0xC0);
}

// A plane that recedes from the eye has no corner, so occlusion does not darken it.
TEST(DepthCue, OcclusionLeavesSlopesAlone) {
    const Framebuffer slope = darkened(DepthCue::ambient_occlusion, [](int, int y) { return 100 / (1 + 0.004 * y); });
    for (int y = 8; y < kHeight - 8; ++y)
        EXPECT_GT(grey(slope, 80, y), 0xC0 - 8) << y;
}

// A wall behind an edge: each of sixteen neighbours, on rings of 1.4 and 4 pixels, that lies in front of it counts as
// if it were 0.012 of the depth nearer, and the light is exp(-150 / 16 x their sum).
TEST(DepthCue, EyeDomeCountsNeighboursOnTwoRings) {
    const Framebuffer target = darkened(DepthCue::eye_dome, [](int x, int) { return x < 80 ? 100.0 : 104.0; });
    constexpr double kLight = 0.52712; // of 0xC0, linear
    const std::array<int, 5> nearer{6, 3, 3, 1, 0};
    for (std::size_t k = 0; k < nearer.size(); ++k) {
        const double light = kLight * std::exp(-150.0 / 16 * 0.012 * nearer[k]);
        const double expected = 255 * (1.055 * std::pow(light, 1 / 2.4) - 0.055);
        EXPECT_NEAR(grey(target, 80 + static_cast<int>(k), 60), expected, 1) << k;
    }
}

// Beside a box, 1, 2, ... pixels from its foot. No formula gives these: they are what they were.
TEST(DepthCue, OcclusionHasItsGoldenGreys) {
    const Framebuffer target = darkened(DepthCue::ambient_occlusion, box);
    constexpr std::array golden{111, 126, 147, 161, 172, 179, 185, 189, 191, 191, 192};
    for (std::size_t k = 0; k < golden.size(); ++k)
        EXPECT_NEAR(grey(target, 59 - static_cast<int>(k), 60), golden[k], 1) << k;
}

} // namespace
} // namespace pbm
