
#include "pbm_render/camera/camera.h"
#include "pbm_render/camera/unit_grid.h"

#include <gtest/gtest.h>

#include <limits>

namespace pbm {
namespace {

using Side = HalfSpaces::Side;

TEST(ClipRegion, SaysHowABoxLiesToAPlaneAndToABox) {
    const HalfSpaces right({.plane = ClipPlane{{1, 7, 7}, {2, 0, 0}}, .box = {}});
    EXPECT_EQ(right.side_of({0, 0, 0}, {0.5, 9, 9}), Side::outside);
    EXPECT_EQ(right.side_of({0, 0, 0}, {1.5, 9, 9}), Side::cut);
    EXPECT_EQ(right.side_of({3, 0, 0}, {1.5, 9, 9}), Side::inside);
    EXPECT_EQ(right.side_of({1, 5, 5}, {0, 0, 0}), Side::inside); // the border belongs to the region

    const HalfSpaces box({.plane = {}, .box = ClipBox{{-1, -2, -3}, {1, 2, 3}}});
    EXPECT_EQ(box.all().size(), 6U);
    EXPECT_EQ(box.side_of({0, 0, 0}, {1, 2, 3}), Side::inside);
    EXPECT_EQ(box.side_of({0, 0, 0}, {1, 2, 3.1}), Side::cut);
    EXPECT_EQ(box.side_of({0, 2.5, 0}, {0.4, 0.4, 0.4}), Side::outside);

    EXPECT_TRUE(HalfSpaces({}).empty());
    EXPECT_EQ(HalfSpaces({}).side_of({0, 0, 0}, {1e300, 1e300, 1e300}), Side::inside);
}

TEST(ClipRegion, IsTheSameInTheUnitGrid) {
    ModelParameters parameters;
    parameters.grid.depth = 8;
    parameters.grid.origin = {100, 200, 300};
    parameters.grid.voxel_size = 4.0 / 256; // an edge of 4
    Camera camera;
    camera.clip = {.plane = ClipPlane{{101, 202, 303}, {0, 3, 4}}, .box = ClipBox{{100, 201, 302}, {104, 204, 304}}};
    const ClipRegion unit = in_unit_grid(camera, parameters).clip;
    EXPECT_EQ(unit.plane->point, glm::dvec3(0.25, 0.5, 0.75));
    EXPECT_EQ(unit.plane->normal, glm::dvec3(0, 3, 4));
    EXPECT_EQ(unit.box->least, glm::dvec3(0, 0.25, 0.5));
    EXPECT_EQ(unit.box->most, glm::dvec3(1, 1, 1));
}

TEST(ClipRegion, WithoutANormalMakesNoUsableCamera) {
    Camera camera;
    camera.clip.plane = {.point = {1, 2, 3}, .normal = {0, 0, 1e-3}};
    EXPECT_TRUE(is_usable(camera));
    camera.clip.plane->normal = {0, 0, 0};
    EXPECT_FALSE(is_usable(camera));
    camera.clip = {.plane = {}, .box = ClipBox{{0, 0, 0}, {1, 1, std::numeric_limits<double>::infinity()}}};
    EXPECT_FALSE(is_usable(camera));
}

} // namespace
} // namespace pbm
