#include "pbm_render/camera/camera.h"
#include "pbm_render/camera/projection.h"
#include "pbm_render/camera/unit_grid.h"
#include "unit/render/test_model.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <gtest/gtest.h>

namespace pbm {
namespace {

TEST(Camera, WithoutALineOfSightIsNotUsable) {
    Camera camera;
    EXPECT_TRUE(is_usable(camera));
    camera.focal_point = camera.position;
    EXPECT_FALSE(is_usable(camera));
    camera = Camera{};
    camera.up = {0, 0, -3};
    EXPECT_FALSE(is_usable(camera));
    camera = Camera{};
    camera.view_angle = 0;
    EXPECT_FALSE(is_usable(camera));
    camera = Camera{};
    camera.position.x = std::nan("");
    EXPECT_FALSE(is_usable(camera));
}

// 100 x 50 pixels, 90 degrees: focal length 25 pixels. The eye is at (0, 0, 10) and looks along -Z.
TEST(Projection, PutsKnownPointsWhereTheyBelong) {
    Camera camera = camera_in_front({0, 0, 0}, 10);
    camera.view_angle = glm::radians(90.0);
    const Projection projection(camera, 100, 50);
    const auto pixel = [&](glm::dvec3 model) {
        const glm::dvec3 p = projection.point(model);
        return glm::dvec3(p.x / p.z, p.y / p.z, p.z);
    };
    EXPECT_NEAR(glm::length(pixel({0, 0, 0}) - glm::dvec3(50, 25, 10)), 0, 1e-9);
    EXPECT_NEAR(glm::length(pixel({4, 0, 5}) - glm::dvec3(70, 25, 5)), 0, 1e-9);
    EXPECT_NEAR(glm::length(pixel({0, 4, 5}) - glm::dvec3(50, 5, 5)), 0, 1e-9); // world up points to row 0
    EXPECT_NEAR(pixel({1, 1, 12}).z, -2, 1e-9);                                 // behind the eye
    EXPECT_NEAR(glm::length(projection.ray({70, 5}) - glm::dvec3(0.8, 0.8, -1)), 0, 1e-12);
}

TEST(Projection, KeepsGeoreferencedModelsSharp) {
    const glm::dvec3 far(4.3e6, 5.6e6, 300);
    const Camera camera = camera_in_front(far, 10);
    const Projection projection(camera, 1000, 1000);
    const glm::dvec3 p = projection.point(far + glm::dvec3(0.001, 0, 0));
    EXPECT_NEAR(p.x / p.z - 500, 0.001 * projection.focal / 10, 1e-6);
}

// A telecentric camera: what lies half a grid before and behind the plane of the focal point is a third of a pixel off.
TEST(OrthographicCamera, ShowsAllDepthsInOneSize) {
    ModelParameters parameters;
    parameters.grid.depth = 10;
    parameters.grid.origin = {100, 200, 300};
    parameters.grid.voxel_size = 0.5;
    const double edge = parameters.grid.edge();
    Camera camera = camera_in_front({100 + edge / 2, 200 + edge / 2, 300 + edge / 2}, 900);
    const auto pixel = [&](const glm::dvec3 &point) {
        const Projection projection(in_unit_grid(camera, parameters), 1280, 720);
        const glm::dvec3 p = projection.point((point - glm::dvec3(100, 200, 300)) / edge);
        return glm::dvec2(p) / p.z;
    };
    const double upper = view_height(camera) / 2; // the upper border of the picture
    const auto place = [&](double z) { return camera.focal_point + glm::dvec3(0, upper, z); };
    EXPECT_NEAR(pixel(place(0)).y, 0, 1e-9);
    EXPECT_GT(std::abs(pixel(place(edge / 2)).y), 100); // in perspective
    camera.orthographic = true;
    EXPECT_NEAR(pixel(place(0)).y, 0, 1e-9);
    EXPECT_NEAR(pixel(place(edge / 2)).y, 0, 0.36);
    EXPECT_NEAR(pixel(place(-edge / 2)).y, 0, 0.36);
    EXPECT_FALSE(in_unit_grid(camera, parameters).orthographic);
}

TEST(Backs, AreHiddenOnlyWhereTheFileSaysThatNoneCanBeSeenOrTheCameraSaysSo) {
    ModelParameters open, closed;
    closed.closed = true;
    Camera camera;
    camera.position = {0, 0, 2 * closed.grid.edge()};
    EXPECT_TRUE(shows_backs(camera, open));
    EXPECT_FALSE(shows_backs(camera, closed));
    EXPECT_EQ(in_unit_grid(camera, open).backs, Backs::show);
    EXPECT_EQ(in_unit_grid(camera, closed).backs, Backs::hide);
    camera.clip.plane = ClipPlane{};
    EXPECT_TRUE(shows_backs(camera, closed)); // it is cut open
    camera.clip = {};
    camera.position = glm::dvec3(closed.grid.edge() / 2); // the eye may be inside of the surface
    EXPECT_TRUE(shows_backs(camera, closed));
    camera.backs = Backs::hide;
    EXPECT_FALSE(shows_backs(camera, open));
    EXPECT_FALSE(shows_backs(camera, closed));
    camera = {};
    camera.backs = Backs::show;
    EXPECT_TRUE(shows_backs(camera, closed));
}

TEST(OrthographicCamera, StaysUsableInTheClosestView) {
    Camera camera = camera_in_front({0.5, 0.5, 0.5}, 1e-3);
    for (const double angle : {170.0, 30.0, 0.01}) {
        camera.view_angle = glm::radians(angle);
        camera.orthographic = true;
        const Camera drawn = telecentric(camera, 1);
        EXPECT_TRUE(is_usable(drawn)) << angle;
        EXPECT_NEAR(view_height(drawn) / view_height(camera), 1, 1e-9) << angle;
        EXPECT_LE(glm::length(drawn.position - drawn.focal_point), kTelecentricDistance * (1 + 1e-9)) << angle;
    }
}

} // namespace
} // namespace pbm
