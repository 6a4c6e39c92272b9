#include "viewer/pbm-view/light/light_motion.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <gtest/gtest.h>

namespace pbm {
namespace {

constexpr double kNear = 1e-5;

glm::dvec3 vector(const std::array<float, 3> &v) { return {v[0], v[1], v[2]}; }

// Radius 2 around (5, 6, 7) from the grid's corner.
LightFrame frame(UpAxis up = UpAxis::y) {
    const Grid grid{.depth = 4, .origin = {-1, -1, -1}};
    return light_frame(grid, {.centre = {4, 5, 6}, .radius = 2}, up);
}

Light spot() { return {.kind = LightKind::spot, .position = {5, 6, 17}, .direction = {0, 0, -1}, .exponent = 8}; }

// How far the ray of a spot passes the centre.
double misses(const Light &light, const LightFrame &frame) {
    const glm::dvec3 way = frame.centre - vector(light.position);
    return glm::length(glm::cross(way, vector(light.direction)));
}

TEST(LightMotion, ASpotThatMovesToTheRightStillLightsTheModel) {
    const Light right = moved_to(spot(), frame(), {.azimuth = glm::radians(90.0), .height = 0, .distance = 5});
    EXPECT_LT(glm::length(vector(right.position) - glm::dvec3(15, 6, 7)), kNear);
    EXPECT_LT(glm::length(vector(right.direction) - glm::dvec3(-1, 0, 0)), kNear);
    for (double azimuth = -3; azimuth < 3; azimuth += 0.37)
        for (double height = -1.5; height < 1.5; height += 0.41)
            EXPECT_LT(misses(moved_to(spot(), frame(), {azimuth, height, 3}), frame()), 1e-4);
}

TEST(LightMotion, ASpotKeepsItsAimRelativeToItsPlace) {
    Light beside = spot();
    beside.position = {6, 6, 17}; // aims 1 to the right of the centre
    const LightBearing from = bearing_of(beside, frame());
    const Light moved = moved_to(beside, frame(), {from.azimuth + 1, from.height, from.distance});
    EXPECT_NEAR(misses(moved, frame()), 1, 1e-4);
    const Light back = moved_to(moved, frame(), from);
    EXPECT_LT(glm::length(vector(back.position) - vector(beside.position)), 1e-4);
    EXPECT_LT(glm::length(vector(back.direction) - vector(beside.direction)), 1e-4);
    EXPECT_LT(misses(aimed_at_centre(beside, frame()), frame()), 1e-4);
}

TEST(LightMotion, BearingsReadBackForEveryKindAndUpAxis) {
    for (const UpAxis up : {UpAxis::x, UpAxis::y, UpAxis::z})
        for (const LightKind kind : {LightKind::directional, LightKind::point, LightKind::spot}) {
            Light light = spot();
            light.kind = kind;
            const LightBearing to{0.7, -0.4, kind == LightKind::directional ? 1.0 : 2.5};
            const LightBearing read = bearing_of(moved_to(light, frame(up), to), frame(up));
            EXPECT_NEAR(read.azimuth, to.azimuth, kNear);
            EXPECT_NEAR(read.height, to.height, kNear);
            EXPECT_NEAR(read.distance, to.distance, kNear);
        }
    // In front of the default camera: azimuth 0.
    EXPECT_NEAR(bearing_of({.direction = {0, 1, 0}}, frame(UpAxis::z)).azimuth, 0, kNear);
}

TEST(LightMotion, LightsNeverGetLost) {
    Light inside = spot();
    inside.position = {5, 6, 7};                            // at the centre
    const Light out = moved_to(inside, frame(), {1, 9, 2}); // the height is clamped
    EXPECT_NEAR(glm::length(vector(out.direction)), 1, kNear);
    EXPECT_NEAR(bearing_of(out, frame()).distance, 2, kNear);
    EXPECT_LT(bearing_of(out, frame()).height, glm::radians(90.0));
    EXPECT_EQ(aimed_at_centre(inside, frame()).direction, inside.direction);
}

TEST(LightMotion, RakingLightComesFromWhereThePointerIs) {
    const Camera camera{.position = {0, 0, 10}, .focal_point = {0, 0, 0}, .up = {0, 1, 0}};
    const auto from = [&](double x, double y) { return raking_direction(eye_axes(camera), {x, y}); };
    EXPECT_LT(glm::length(from(0, 0) - glm::dvec3(0, 0, 1)), kNear);
    EXPECT_LT(glm::length(from(0.6, 0) - glm::dvec3(0.6, 0, 0.8)), kNear);
    EXPECT_GT(from(0, 5).y, 0.99);
    EXPECT_GT(from(0, 5).z, 0.01); // never from behind
    EXPECT_NEAR(glm::length(from(-3, 4)), 1, kNear);
    const Light light = moved_towards(spot(), frame(), from(1, 0));
    EXPECT_GT(light.position[0], 14);
    EXPECT_LT(misses(light, frame()), 1e-4);
}

TEST(LightMotion, OnlyWhatShadowsDependOnIsThePlace) {
    Light a = spot(), b = a;
    b.intensity = {0, 0, 9};
    b.exponent = 1;
    EXPECT_TRUE(same_place(a, b));
    b.position[0] += 1;
    EXPECT_FALSE(same_place(a, b));
    a.kind = b.kind = LightKind::directional;
    EXPECT_TRUE(same_place(a, b));
    b.direction = {1, 0, 0};
    EXPECT_FALSE(same_place(a, b));
    a.kind = LightKind::point;
    EXPECT_FALSE(same_place(a, b));
}

} // namespace
} // namespace pbm
