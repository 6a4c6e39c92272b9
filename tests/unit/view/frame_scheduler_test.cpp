#include "viewer/scene/frame_scheduler.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pbm {
namespace {

constexpr double kExact = 0.5; // pixels
constexpr FrameScheduler::Errors kErrors{.still = kExact, .moving = kExact};
constexpr double kSecondsPerPoint = 25e-9;

// points = 4e6 * (exact error / error)^2, as for a surface; the simulated computer draws 4e6 points in 100 ms.
std::uint64_t points_at(double max_error) { return static_cast<std::uint64_t>(4e6 * std::pow(kExact / max_error, 2)); }
double seconds(double max_error) { return kSecondsPerPoint * static_cast<double>(points_at(max_error)); }

FrameScheduler::Picture picture(double max_error, bool complete = true) {
    return {
        .max_error = max_error, .points = points_at(max_error), .complete = complete, .seconds = seconds(max_error)};
}

// A scheduler that has drawn the exact picture and has measured the time per point.
FrameScheduler rested(double min_fps) {
    FrameScheduler scheduler(kErrors, min_fps);
    scheduler.drawn(picture(kExact), 0);
    return scheduler;
}

// The error of the next picture of a moving view.
double moving_error(FrameScheduler &scheduler, double now) {
    scheduler.view_changed(now, kErrors);
    const auto step = scheduler.next(now, points_at);
    EXPECT_TRUE(step && step->at_once);
    return step ? step->max_error : 0;
}

TEST(FrameScheduler, DrawsTheFirstPictureAtOnceAndRefinesItWithoutRest) {
    FrameScheduler scheduler(kErrors, 30);
    EXPECT_LE(*scheduler.due(), 0);
    const auto first = scheduler.next(5, points_at);
    ASSERT_TRUE(first);
    EXPECT_TRUE(first->at_once);
    EXPECT_GT(first->max_error, kExact); // the time per point is still a guess
    scheduler.drawn(picture(first->max_error), 5.01);
    EXPECT_FALSE(scheduler.complete());
    const auto exact = scheduler.next(5.01, points_at);
    ASSERT_TRUE(exact);
    EXPECT_EQ(exact->max_error, kExact);
    EXPECT_FALSE(exact->at_once); // it takes 100 ms
    scheduler.drawn(picture(kExact), 5.2);
    EXPECT_TRUE(scheduler.complete());
    EXPECT_FALSE(scheduler.due());
    EXPECT_FALSE(scheduler.next(1e9, points_at));
}

TEST(FrameScheduler, AMovingViewKeepsItsRateByALargerError) {
    for (const double fps : {10.0, 30.0, 60.0}) {
        FrameScheduler scheduler = rested(fps);
        const double error = moving_error(scheduler, 1);
        EXPECT_LE(seconds(error), 1 / fps) << fps;
        EXPECT_EQ(error > kExact, seconds(kExact) > FrameScheduler::kDrawingShare / fps) << fps;
        const double finer = error / FrameScheduler::kErrorStep;
        EXPECT_TRUE(error == kExact || seconds(finer) > FrameScheduler::kDrawingShare / fps)
            << fps; // the error is no larger than necessary
    }
}

TEST(FrameScheduler, IsNeverCoarserWhereNoRateIsAskedFor) {
    FrameScheduler scheduler = rested(0);
    EXPECT_EQ(moving_error(scheduler, 1), kExact);
    scheduler.drawn({.max_error = kExact, .points = 1'000'000, .complete = true, .seconds = 10}, 11);
    EXPECT_EQ(moving_error(scheduler, 12), kExact);
}

// A close view and a small model are at their finest level: a larger error would draw the same points.
TEST(FrameScheduler, IsNeverCoarserWhereThatLeavesOutFewPoints) {
    const auto draw = [](double saving) {
        const auto points = [&](double error) {
            return static_cast<std::uint64_t>(4e6 * (1 - saving * (error - kExact) / FrameScheduler::kLargestError));
        };
        FrameScheduler scheduler = rested(30);
        double largest = 0;
        for (int i = 0; i < 40; ++i) { // each picture takes four times as long as it may
            const double now = 1 + 0.01 * i;
            scheduler.view_changed(now, kErrors);
            const double error = scheduler.next(now, points)->max_error;
            scheduler.drawn({.max_error = error, .points = points(error), .complete = true, .seconds = 0.1}, now);
            largest = std::max(largest, error);
        }
        return largest;
    };
    EXPECT_EQ(draw(0), kExact);
    EXPECT_EQ(draw(0.1), kExact);
    EXPECT_GT(draw(0.5), 2);
}

// The pictures of a moving view may be coarser than that of the same view at rest, even where time allows more.
TEST(FrameScheduler, AMovingViewIsNoFinerThanItsOwnError) {
    constexpr FrameScheduler::Errors kTwo{.still = kExact, .moving = 1};
    FrameScheduler scheduler(kTwo, 0);
    EXPECT_EQ(scheduler.next(0, points_at)->max_error, kExact); // nothing has moved yet
    scheduler.drawn(picture(kExact), 0);
    for (int i = 1; i < 5; ++i) {
        scheduler.view_changed(i, kTwo);
        EXPECT_EQ(scheduler.next(i, points_at)->max_error, 1);
        scheduler.drawn(picture(1), i);
        EXPECT_FALSE(scheduler.complete());
    }
    EXPECT_EQ(scheduler.next(6, points_at)->max_error, kExact);
    scheduler.drawn(picture(kExact), 6);
    EXPECT_TRUE(scheduler.complete());
    // A model at its finest level has no coarser picture to draw first.
    scheduler.view_changed(7, kTwo);
    EXPECT_EQ(scheduler.next(7, [](double) { return std::uint64_t{4'000'000}; })->max_error, kExact);
    // The user chose fast pictures: these are exact.
    constexpr FrameScheduler::Errors kFast{.still = 1, .moving = 1};
    scheduler.view_changed(8, kFast);
    EXPECT_EQ(scheduler.next(8, points_at)->max_error, 1);
    scheduler.drawn(picture(1), 8);
    EXPECT_TRUE(scheduler.complete());
}

TEST(FrameScheduler, ReturnsToTheExactErrorWhenTheViewRests) {
    FrameScheduler scheduler = rested(30);
    const double error = moving_error(scheduler, 10);
    scheduler.drawn(picture(error), 10.02);
    EXPECT_FALSE(scheduler.complete());
    EXPECT_NEAR(*scheduler.due(), 10 + FrameScheduler::kRest, 1e-9);
    EXPECT_FALSE(scheduler.next(10.05, points_at));
    const auto step = scheduler.next(10.11, points_at);
    ASSERT_TRUE(step);
    EXPECT_EQ(step->max_error, kExact);
    EXPECT_FALSE(step->at_once);
}

TEST(FrameScheduler, RefinesOnlyAViewThatRests) {
    FrameScheduler scheduler(kErrors, 0);
    EXPECT_FALSE(scheduler.refinement_due());
    scheduler.drawn(picture(kExact, false), 1);
    EXPECT_FALSE(scheduler.refinement_due());
    scheduler.drawn(picture(kExact), 2);
    EXPECT_LE(*scheduler.refinement_due(), 2); // the first picture of a model does not wait
    scheduler.view_changed(10, kErrors);
    EXPECT_FALSE(scheduler.refinement_due());
    scheduler.drawn(picture(kExact), 10.01); // exact, but the view may still move
    EXPECT_NEAR(*scheduler.refinement_due(), 10.01 + FrameScheduler::kStill, 1e-9);
}

// Chunks that do not fit into the memory are not asked for again and again.
TEST(FrameScheduler, DoesNotRefineAnExactPictureThatLacksChunks) {
    FrameScheduler scheduler = rested(30);
    scheduler.drawn(picture(moving_error(scheduler, 10)), 10.03);
    EXPECT_TRUE(scheduler.refinement_due());
    scheduler.drawn(picture(kExact, false), 10.2);
    EXPECT_FALSE(scheduler.refinement_due());
    scheduler.drawn(picture(kExact), 10.3);
    EXPECT_NEAR(*scheduler.refinement_due(), 10.3 + FrameScheduler::kStill, 1e-9);
}

// The refined picture takes the place of the exact one.
TEST(FrameScheduler, RefinesAViewThatMovedWithoutTheExactPicture) {
    FrameScheduler scheduler = rested(30);
    const double error = moving_error(scheduler, 10);
    EXPECT_GT(error, kExact);
    scheduler.drawn(picture(error, false), 10.03);
    EXPECT_NEAR(*scheduler.refinement_due(), 10.03 + FrameScheduler::kStill, 1e-9);
    scheduler.refined();
    EXPECT_TRUE(scheduler.complete());
    EXPECT_FALSE(scheduler.due());
    EXPECT_FALSE(scheduler.next(11, points_at));
    EXPECT_GT(moving_error(scheduler, 12), kExact); // the time per point is still known
}

TEST(FrameScheduler, DrawsAtOnceWhatTakesNoLongerThanTheBudget) {
    FrameScheduler scheduler(kErrors, 60);
    scheduler.drawn({.max_error = kExact, .points = points_at(kExact), .complete = true, .seconds = 0.03}, 0);
    const double error = moving_error(scheduler, 1);
    EXPECT_GT(error, kExact);
    scheduler.drawn({.max_error = error, .points = points_at(error), .complete = true, .seconds = 0.01}, 1.01);
    EXPECT_TRUE(scheduler.next(1.2, points_at)->at_once);
}

// Draws the picture that is due on a computer that takes `slow` times as long as the simulated one.
double draw_moving(FrameScheduler &scheduler, double now, double slow) {
    const double error = moving_error(scheduler, now);
    FrameScheduler::Picture drawn = picture(error);
    drawn.seconds *= slow;
    scheduler.drawn(drawn, now);
    return error;
}

TEST(FrameScheduler, ChangesTheErrorInSmallSteps) {
    FrameScheduler scheduler = rested(30);
    double last = draw_moving(scheduler, 1, 1), now = 1;
    const double first = last;
    for (const double slow : {1.5, 4.0, 0.5, 0.01}) {
        for (int i = 0; i < 100; ++i) {
            const double error = draw_moving(scheduler, now += 0.01, slow);
            const double largest_step = slow >= 2 ? FrameScheduler::kHurriedStep : FrameScheduler::kErrorStep;
            EXPECT_LE(error, last * largest_step * 1.000001) << slow;
            EXPECT_GE(error, last / FrameScheduler::kErrorStep * 0.999999) << slow;
            last = error;
        }
        EXPECT_LE(slow * seconds(last), FrameScheduler::kDrawingShare / 30) << slow; // it has settled
        EXPECT_EQ(last > first, slow > 1) << slow;
    }
    EXPECT_EQ(last, kExact);
}

TEST(FrameScheduler, HurriesWherePicturesTakeFarTooLong) {
    FrameScheduler scheduler = rested(30);
    const double error = draw_moving(scheduler, 1, 4);
    EXPECT_DOUBLE_EQ(moving_error(scheduler, 1.05), error * FrameScheduler::kHurriedStep);
}

TEST(FrameScheduler, DoesNotWaverOnAComputerWhoseSpeedVaries) {
    FrameScheduler scheduler = rested(30);
    double last = draw_moving(scheduler, 1, 1), now = 1;
    int finer = 0, coarser = 0;
    for (int i = 0; i < 200; ++i) {
        const double error = draw_moving(scheduler, now += 0.01, i % 3 == 0 ? 1.2 : 0.9);
        finer += error < last;
        coarser += error > last;
        last = error;
    }
    EXPECT_EQ(finer, 0);
    EXPECT_LE(coarser, 4); // to where the slow pictures fit
}

TEST(FrameScheduler, AMotionAfterRestStartsAtTheErrorThatFits) {
    FrameScheduler scheduler = rested(30);
    double now = 1;
    for (int i = 0; i < 50; ++i)
        draw_moving(scheduler, now += 0.01, 4);
    EXPECT_GT(scheduler.shown()->max_error, 1.8);
    scheduler.drawn(picture(kExact), now + 1); // at rest, and the computer is fast again
    FrameScheduler other = rested(30);
    EXPECT_DOUBLE_EQ(moving_error(scheduler, now + 2), moving_error(other, 1));
}

TEST(FrameScheduler, NeverGetsCoarserThanHelps) {
    FrameScheduler scheduler = rested(30);
    // A huge window: the time depends on pixels, not on points.
    for (int i = 1; i < 50; ++i) {
        const double error = moving_error(scheduler, i);
        EXPECT_LE(error, FrameScheduler::kLargestError);
        scheduler.drawn({.max_error = error, .points = points_at(error), .complete = true, .seconds = 5}, i);
    }
    // An exact error beyond that limit stays.
    constexpr FrameScheduler::Errors kCoarse{.still = 8, .moving = 8};
    FrameScheduler coarse(kCoarse, 30);
    coarse.drawn({.max_error = 8, .points = 10'000'000, .complete = true, .seconds = 5}, 0);
    coarse.view_changed(1, kCoarse);
    EXPECT_EQ(coarse.next(1, [](double) { return std::uint64_t{10'000'000}; })->max_error, 8);
}

TEST(FrameScheduler, EverySmallModelIsDrawnExactAtOnce) {
    FrameScheduler scheduler(kErrors, 240);
    const auto few = [](double) { return FrameScheduler::kFewPoints; };
    EXPECT_EQ(scheduler.next(0, few)->max_error, kExact);
    scheduler.drawn({.max_error = kExact, .points = 50'000, .complete = true, .seconds = 0.3}, 0.3);
    scheduler.view_changed(1, kErrors);
    EXPECT_EQ(scheduler.next(1, few)->max_error, kExact);
}

TEST(FrameScheduler, DrawsAgainWhenChunksArriveButNotAllTheTime) {
    FrameScheduler scheduler(kErrors, 30);
    scheduler.drawn(picture(kExact, false), 10); // took 0.1 s
    EXPECT_FALSE(scheduler.complete());
    EXPECT_FALSE(scheduler.due()); // no chunk has arrived
    EXPECT_FALSE(scheduler.next(1e9, points_at));
    scheduler.arrived(false);
    EXPECT_NEAR(*scheduler.due(), 10 + FrameScheduler::kPause * 0.1, 1e-9);
    EXPECT_FALSE(scheduler.next(10.1, points_at));
    EXPECT_EQ(scheduler.next(10.3, points_at)->max_error, kExact);
    scheduler.arrived(true); // no further chunk is expected
    scheduler.arrived(false);
    EXPECT_LE(*scheduler.due(), 10);
    EXPECT_TRUE(scheduler.next(10.1, points_at));
    scheduler.drawn(picture(kExact, false), 10.2); // incomplete, because memory is used up
    EXPECT_FALSE(scheduler.due());
    scheduler.arrived(true);
    scheduler.drawn(picture(kExact), 10.3);
    EXPECT_TRUE(scheduler.complete());
    scheduler.arrived(true); // a chunk of an older view
    EXPECT_FALSE(scheduler.due());
}

// New shadows are no motion: the next picture has full detail, and the one shown stays until then.
TEST(FrameScheduler, ANewLookOfTheSameViewIsDrawnAtFullDetailOnly) {
    FrameScheduler scheduler = rested(30);
    EXPECT_FALSE(scheduler.due());
    scheduler.restyled();
    EXPECT_FALSE(scheduler.complete());
    const auto step = scheduler.next(5, points_at);
    ASSERT_TRUE(step);
    EXPECT_EQ(step->max_error, kExact);
    scheduler.drawn(picture(kExact), 6);
    EXPECT_TRUE(scheduler.complete());
    EXPECT_FALSE(scheduler.due());
}

TEST(FrameScheduler, ChunksThatArriveDoNotEndAMotion) {
    FrameScheduler scheduler = rested(30);
    const double error = moving_error(scheduler, 10);
    scheduler.drawn(picture(error, false), 10.02);
    scheduler.arrived(true);
    EXPECT_FALSE(scheduler.next(10.05, points_at));
    EXPECT_EQ(scheduler.next(10.2, points_at)->max_error, kExact);
}

} // namespace
} // namespace pbm
