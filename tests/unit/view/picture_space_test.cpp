// What pixels show is found at its true place, in pictures of a plane and of a ball.
#include "viewer/pbm-view/measure/picture_space.h"

#include "pbm_render/fine/fine_renderer.h"
#include "unit/render/fast_test_model.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

constexpr glm::ivec2 kShown{200, 150};
const double kUncertainty = std::sqrt(3.0) / 2; // voxels; see point_uncertainty

Camera oblique(glm::dvec3 target, double distance, bool orthographic) {
    Camera camera;
    camera.focal_point = target;
    camera.position = target + distance * glm::normalize(glm::dvec3(0.3, 0.4, 1));
    camera.orthographic = orthographic;
    return camera;
}

Framebuffer fine(const test::DrawnModel &drawn, const Camera &camera) {
    Framebuffer target(kShown.x, kShown.y);
    const test::WholeLevel level(drawn.file, drawn.model.parameters.grid.depth);
    FineRenderer(drawn.model.parameters, drawn.chunk_points, 1).render(level.runs, camera, {}, target, 2);
    return target;
}

// Distance from the surface, in voxels, of what the pixels show: the mean, and for 99 of 100 pixels.
template <class Distance>
glm::dvec2 errors(const Framebuffer &picture, const Camera &camera, const Grid &grid, const Distance &distance) {
    const PictureSpace space(camera, grid.edge(), kShown);
    std::vector<double> all;
    for (int y = 0; y < kShown.y; ++y)
        for (int x = 0; x < kShown.x; ++x)
            if (const auto point = pick(picture, space, {x, y}))
                all.push_back(std::abs(distance(point->place)) / grid.voxel_size);
    EXPECT_GT(all.size(), 3000U);
    std::sort(all.begin(), all.end());
    double sum = 0;
    for (const double error : all)
        sum += error;
    return {sum / static_cast<double>(all.size()), all[all.size() * 99 / 100]};
}

// A wall of voxels at z = 3, far from the origin as georeferenced scans are. Their centres lie on one plane.
TEST(Pick, PointsOfAPlaneLieOnThePlane) {
    Model wall = make_wall(5, 3);
    wall.metadata = "{}";
    wall.parameters.grid.origin = {8.5e6, -4.25e6, 312};
    wall.parameters.grid.voxel_size = 0.125;
    const double height = 312 + 3.5 * 0.125;
    const test::DrawnModel drawn(wall);
    for (const bool orthographic : {false, true}) {
        const Camera camera = oblique({8.5e6 + 2, -4.25e6 + 2, height}, 9, orthographic);
        const auto from_plane = [&](const glm::dvec3 &point) { return point.z - height; };
        for (const Framebuffer &picture : {drawn.fast(camera, kShown.x, kShown.y, {}), fine(drawn, camera)}) {
            const glm::dvec2 error = errors(picture, camera, wall.parameters.grid, from_plane);
            EXPECT_LT(error.x, 0.2) << orthographic; // depths between the middles of splats lie a little behind
            EXPECT_LT(error.y, kUncertainty) << orthographic;
        }
    }
}

TEST(Pick, PointsOfABallLieOnTheBall) {
    const test::DrawnModel drawn(test::smooth_ball(7, {}));
    const glm::dvec3 centre(0, -1, -2);
    for (const bool orthographic : {false, true}) {
        const Camera camera = oblique(centre, 5, orthographic);
        const auto from_ball = [&](const glm::dvec3 &point) { return glm::length(point - centre) - 0.9; };
        for (const Framebuffer &picture : {drawn.fast(camera, kShown.x, kShown.y, {}), fine(drawn, camera)}) {
            const glm::dvec2 error = errors(picture, camera, drawn.model.parameters.grid, from_ball);
            EXPECT_LT(error.x, 0.25) << orthographic;
            EXPECT_LT(error.y, kUncertainty) << orthographic;
        }
        // Its diameter, from the two pixels whose places are farthest to the left and to the right.
        const Framebuffer picture = drawn.fast(camera, kShown.x, kShown.y, {});
        const PictureSpace space(camera, drawn.model.parameters.grid.edge(), kShown);
        const glm::dvec3 right = eye_axes(camera).right;
        glm::dvec3 first = centre, last = centre;
        for (int y = 0; y < kShown.y; ++y)
            for (int x = 0; x < kShown.x; ++x)
                if (const auto point = pick(picture, space, {x, y})) {
                    first = glm::dot(point->place - first, right) < 0 ? point->place : first;
                    last = glm::dot(point->place - last, right) > 0 ? point->place : last;
                }
        // Seen from a distance of 5, the outline is a smaller circle.
        const double widest = orthographic ? 1.8 : 1.8 * std::sqrt(1 - 0.18 * 0.18);
        const double pixel = space.pixel_size(space.focal_depth()); // a little larger than a voxel
        EXPECT_NEAR(glm::dot(last - first, right), widest, 2 * kUncertainty * 1.42 * pixel) << orthographic;
    }
}

TEST(Pick, ThereIsNothingInTheBackgroundNorOutsideThePicture) {
    const test::DrawnModel drawn(test::smooth_ball(5, {}));
    const Camera camera = oblique({0, -1, -2}, 9, false);
    const Framebuffer picture = drawn.fast(camera, kShown.x, kShown.y, {});
    const PictureSpace space(camera, 2, kShown);
    EXPECT_TRUE(pick(picture, space, kShown / 2));
    for (const glm::ivec2 pixel : {glm::ivec2(0), kShown - 1, glm::ivec2(-1, 75), glm::ivec2(100, -1),
                                   glm::ivec2(kShown.x, 75), glm::ivec2(100, kShown.y)})
        EXPECT_FALSE(pick(picture, space, pixel));
    EXPECT_FALSE(pick(Framebuffer(kShown.x, kShown.y, false), space, kShown / 2)) << "a picture without depths";
}

TEST(PictureSpace, LeadsFromAPointToItsPixelAndBack) {
    for (const bool orthographic : {false, true}) {
        const Camera camera = oblique({8.5e6, 3, 5}, 20, orthographic);
        const PictureSpace space(camera, 16, kShown);
        const glm::dvec3 point(8.5e6 + 1.5, 2.25, 7);
        const PictureSpace::Place place = space.place(point);
        EXPECT_NEAR(glm::length(space.point(place.pixel, place.depth) - point), 0, 1e-6);
        EXPECT_GT(place.depth, 0);
        const glm::dvec3 behind = camera.position + 2.0 * (camera.position - camera.focal_point);
        EXPECT_EQ(space.place(behind).depth > 0, orthographic); // an orthographic camera sees all depths
        // The height of the picture in the plane of the focal point.
        EXPECT_NEAR(space.pixel_size(space.focal_depth()) * kShown.y, view_height(camera), 1e-9);
        EXPECT_NEAR(glm::length(space.place(camera.focal_point).pixel - glm::dvec2(kShown) / 2.0), 0, 1e-6);
    }
}

} // namespace
} // namespace pbm
