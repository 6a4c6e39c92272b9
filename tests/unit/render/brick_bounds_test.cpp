// Bounds of bricks on the screen, and the bricks that the fast renderer leaves out because of them.
#include "pbm_render/splats/brick_bounds.h"

#include "pbm_render/camera/unit_grid.h"
#include "unit/render/fast_test_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace pbm {
namespace {

using test::camera_at_ball;
using test::DrawnModel;
using test::smooth_ball;
using test::WholeLevel;

constexpr int kBoundsDepth = 6, kBoundsWidth = 160, kBoundsHeight = 120;

// Draws each brick of a ball alone: its pixels are within its bounds, and the nearest of all of them are those of the
// picture of the whole ball, from which most bricks of its far side and many at its outline are left out.
void expect_bounds(const DrawnModel &model, const Camera &camera) {
    const Grid &grid = model.model.parameters.grid;
    WholeLevel level(model.file, kBoundsDepth);
    if (!model.placed)
        level.forget_offsets();
    FastRenderer renderer(model.model.parameters, model.chunk_points, 1);
    Framebuffer whole(kBoundsWidth, kBoundsHeight), alone(kBoundsWidth, kBoundsHeight);
    const RenderStatistics all = renderer.render(level.runs, camera, {}, whole);
    const FrameGeometry frame(Projection(in_unit_grid(camera, model.model.parameters), kBoundsWidth, kBoundsHeight),
                              kBoundsWidth, kBoundsHeight);
    auto nearest = whole.depth;
    std::fill(nearest.begin(), nearest.end(), std::numeric_limits<float>::infinity());
    std::uint64_t drawn = 0;
    for (const PointRun &run : level.runs) {
        const std::span<const BrickRecord> bricks = run.chunk->bricks;
        for (std::size_t i = 0; i < bricks.size(); ++i) {
            PointRun brick = run;
            brick.first = bricks[i].first_point;
            brick.last = i + 1 < bricks.size() ? bricks[i + 1].first_point : run.last;
            drawn += renderer.render(std::span(&brick, 1), camera, {}, alone).drawn_points;
            const RunGeometry geometry(brick, frame);
            std::vector<VisibleBrick> seen(bricks.size());
            seen.resize(find_visible_bricks(geometry, frame, seen));
            bound_bricks(frame, geometry, seen);
            for (int y = 0; y < kBoundsHeight; ++y)
                for (int x = 0; x < kBoundsWidth; ++x) {
                    const auto at = static_cast<std::size_t>(y) * kBoundsWidth + static_cast<std::size_t>(x);
                    if (alone.depth[at] == std::numeric_limits<float>::infinity())
                        continue;
                    ASSERT_EQ(seen.size(), 1U);
                    ASSERT_GE(x, seen[0].left);
                    ASSERT_LT(x, seen[0].right);
                    ASSERT_GE(y, seen[0].top);
                    ASSERT_LT(y, seen[0].bottom);
                    ASSERT_GE(alone.depth[at], seen[0].nearest * static_cast<float>(grid.edge()));
                    nearest[at] = std::min(nearest[at], alone.depth[at]);
                }
        }
    }
    EXPECT_EQ(nearest, whole.depth);
    EXPECT_LE(all.drawn_points, drawn);
}

TEST(BrickBounds, HoldEveryPixelAndHideNoneThatIsSeen) {
    for (const bool placed : {false, true}) {
        DrawnModel model(smooth_ball(kBoundsDepth, {}, 50));
        model.placed = placed;
        for (const double pixels : {0.4, 1.42, 1.6, 2.0, 3.0, 12.0})
            for (const glm::dvec3 &direction : {glm::dvec3(0.3, 0.5, 0.8), glm::dvec3(-1, 0.01, 0)}) {
                SCOPED_TRACE(pixels);
                expect_bounds(model, camera_at_ball(kBoundsDepth, pixels, kBoundsHeight, direction));
            }
        Camera close; // just outside of the ball, at a wide angle
        close.focal_point = {0, -1, -2};
        close.position = {0.5, -0.4, -1.2};
        close.view_angle = 2;
        expect_bounds(model, close);
    }
}

TEST(BrickBounds, LeaveOutBricksThatLieBehindOthers) {
    // Two-sided points: the far side of the ball faces the eye as well.
    const DrawnModel model(smooth_ball(8, {}, 1));
    WholeLevel level(model.file, 8);
    FastRenderer renderer(model.model.parameters, model.chunk_points, 1);
    Framebuffer target(600, 600);
    const RenderStatistics drawn = renderer.render(level.runs, camera_at_ball(8, 1.4, 600), {}, target);
    EXPECT_LT(drawn.drawn_points, drawn.points * 3 / 4);
}

} // namespace
} // namespace pbm
