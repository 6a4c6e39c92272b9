#include "unit/render_test_model.h"
#include "viewer/frame_scheduler.h"

#include <gtest/gtest.h>

namespace pbm {
namespace {

// Levels 0..5; the finest takes 250 ms on a computer that draws a point in 25 ns.
const std::vector<std::uint64_t> kPoints{1, 8, 4'000, 160'000, 640'000, 10'000'000};
constexpr double kSecondsPerPoint = 25e-9;

double seconds(int level) { return kSecondsPerPoint * static_cast<double>(kPoints[static_cast<std::size_t>(level)]); }

TEST(LevelPoints, CountsEveryLevel) {
    EXPECT_EQ(level_points(make_wall(3, 2)), (std::vector<std::uint64_t>{1, 4, 16, 64}));
}

TEST(FrameScheduler, DrawsTheFirstPictureAtOnceAndCoarse) {
    const FrameScheduler scheduler(kPoints, kMaxDepth);
    const auto step = scheduler.next(0);
    ASSERT_TRUE(step);
    EXPECT_EQ(step->level, 4);
    EXPECT_TRUE(step->at_once);
    EXPECT_LE(*scheduler.due(), 0);
}

TEST(FrameScheduler, RefinesLevelByLevelWhenTheViewRestsAndThenSleeps) {
    FrameScheduler scheduler(kPoints, kMaxDepth);
    scheduler.view_changed(10);
    scheduler.drawn(3, seconds(3));
    EXPECT_FALSE(scheduler.next(10.05));
    EXPECT_NEAR(*scheduler.due(), 10 + FrameScheduler::kRest, 1e-9);
    auto step = scheduler.next(10.2);
    ASSERT_TRUE(step);
    EXPECT_EQ(step->level, 4);
    EXPECT_TRUE(step->at_once); // 16 ms
    scheduler.drawn(4, seconds(4));
    step = scheduler.next(10.3);
    ASSERT_TRUE(step);
    EXPECT_EQ(step->level, 5);
    EXPECT_FALSE(step->at_once); // 250 ms
    EXPECT_FALSE(scheduler.complete());
    scheduler.drawn(5, seconds(5));
    EXPECT_TRUE(scheduler.complete());
    EXPECT_FALSE(scheduler.next(1e9));
    EXPECT_FALSE(scheduler.due());
}

TEST(FrameScheduler, AChangedViewIsDrawnAtOnceAsFineAsTheBudgetAllows) {
    FrameScheduler scheduler(kPoints, kMaxDepth);
    scheduler.view_changed(1);
    scheduler.drawn(5, seconds(5));
    scheduler.view_changed(2);
    EXPECT_FALSE(scheduler.shown());
    auto step = scheduler.next(2);
    ASSERT_TRUE(step);
    EXPECT_TRUE(step->at_once);
    EXPECT_EQ(step->level, 4);
    // A slow picture makes the next one coarser, a fast one finer.
    scheduler.drawn(4, 0.1);
    scheduler.view_changed(3);
    EXPECT_EQ(scheduler.next(3)->level, 3);
    scheduler.drawn(3, 0.002);
    scheduler.view_changed(4);
    EXPECT_EQ(scheduler.next(4)->level, 4);
    scheduler.drawn(4, 0.001);
    scheduler.view_changed(5);
    EXPECT_EQ(scheduler.next(5)->level, 5);
}

TEST(FrameScheduler, DoesNotWaverBetweenTwoLevels) {
    FrameScheduler scheduler(kPoints, kMaxDepth);
    scheduler.drawn(3, 0.008); // four times as many points: 32 ms, too near to the budget to go finer
    scheduler.view_changed(1);
    EXPECT_EQ(scheduler.next(1)->level, 3);
    scheduler.drawn(3, 0.005);
    scheduler.view_changed(2);
    EXPECT_EQ(scheduler.next(2)->level, 4);
    scheduler.drawn(4, 0.035); // not so near that it must go coarser
    scheduler.view_changed(3);
    EXPECT_EQ(scheduler.next(3)->level, 4);
}

TEST(FrameScheduler, NeverGetsCoarserThanHelps) {
    FrameScheduler scheduler(kPoints, kMaxDepth);
    scheduler.drawn(3, 5.0); // a huge window: pixels cost more than points
    scheduler.view_changed(1);
    EXPECT_EQ(scheduler.next(1)->level, 2);
    scheduler.drawn(2, 5.0);
    scheduler.view_changed(2);
    EXPECT_EQ(scheduler.next(2)->level, 2);
}

TEST(FrameScheduler, StopsAtTheLevelAskedFor) {
    FrameScheduler scheduler(kPoints, 2);
    EXPECT_EQ(scheduler.next(0)->level, 2);
    scheduler.drawn(2, 0.001);
    EXPECT_TRUE(scheduler.complete());
    EXPECT_FALSE(scheduler.due());
    FrameScheduler root(kPoints, 0);
    EXPECT_EQ(root.next(0)->level, 0);
}

TEST(FrameScheduler, EverySmallModelIsDrawnFinestAtOnce) {
    FrameScheduler scheduler({1, 8, 50'000}, kMaxDepth);
    EXPECT_EQ(scheduler.next(0)->level, 2);
    scheduler.drawn(2, 0.3); // whatever a frame costs
    scheduler.view_changed(1);
    EXPECT_EQ(scheduler.next(1)->level, 2);
}

} // namespace
} // namespace pbm
