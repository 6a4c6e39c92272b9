#include "pbm_render/reference/reference_renderer.h"
#include "unit/render/test_model.h"

#include <glm/trigonometric.hpp>
#include <gtest/gtest.h>

#include <cmath>

namespace pbm {
namespace {

struct Picture {
    Framebuffer target;
    RenderStatistics drawn;

    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(target.width) + static_cast<std::size_t>(x);
    }
    float depth(int x, int y) const { return target.depth[at(x, y)]; }
    Rgba8 colour(int x, int y) const { return unpack_rgba(target.colour[at(x, y)]); }
    std::size_t covered() const {
        const auto begin = target.depth.begin();
        return target.pixels() - static_cast<std::size_t>(
                                     std::count(begin, begin + static_cast<std::ptrdiff_t>(target.pixels()), kEmpty));
    }
};

Picture draw(const Model &model, const Camera &camera, const RenderOptions &options = {}, int width = 64,
             int height = 64, int level = kMaxDepth) {
    Picture picture{Framebuffer(width, height), {}};
    picture.drawn = ReferenceRenderer(model).render(camera, options, picture.target, level);
    return picture;
}

Picture draw_level(const Model &model, const Camera &camera, int level) {
    return draw(model, camera, {}, 64, 64, level);
}

TEST(ReferenceRenderer, DrawsAPointWhereItProjects) {
    // Far enough that the voxel is smaller than a pixel: exactly one pixel is drawn.
    const Model model = make_test_model(4, {{{7, 9, 3}}});
    Camera camera = camera_in_front({7.5, 9.5, 3.5}, 500);
    camera.position += glm::dvec3(0.01, 0.01, 0); // away from the pixel's border
    camera.focal_point += glm::dvec3(0.01, 0.01, 0);
    const Picture picture = draw(model, camera);
    EXPECT_EQ(picture.covered(), 1U);
    EXPECT_NEAR(picture.depth(31, 32), 500, 0.5);
    EXPECT_EQ(picture.drawn.drawn_points, 1U);
}

TEST(ReferenceRenderer, DrawsLargePointsAsDiscs) {
    const Picture picture = draw(make_test_model(4, {{{7, 9, 3}}}), camera_in_front({7.5, 9.5, 3.5}, 10));
    const double radius = 0.89 * 32 / std::tan(glm::radians(15.0)) / 10;
    EXPECT_NEAR(static_cast<double>(picture.covered()), 3.14159 * radius * radius, 12);
    EXPECT_EQ(picture.depth(31, 31), picture.depth(33, 33));
    EXPECT_EQ(picture.depth(2, 2), kEmpty);
}

TEST(ReferenceRenderer, FillsAWallWithoutHoles) {
    const Model model = make_wall(6, 20);
    for (const double distance : {30.0, 60.0, 110.0}) {
        const Picture picture = draw(model, camera_in_front({32, 32, 20.5}, distance), {}, 50, 50);
        EXPECT_EQ(picture.covered(), 2500U) << distance;
    }
}

TEST(ReferenceRenderer, DepthIsThatOfThePlaneInPerspective) {
    // A wall turned by 45 degrees: the plane x + z = 64.
    std::vector<TestVoxel> voxels;
    for (std::uint32_t x = 0; x < 64; ++x)
        for (std::uint32_t y = 0; y < 64; ++y)
            voxels.push_back({{x, y, 63 - x}, {1, 0, 1}});
    const Model model = make_test_model(6, voxels);
    const Camera camera = camera_in_front({32, 32, 32}, 60);
    const Picture picture = draw(model, camera, {}, 60, 40);
    const double focal = 20 / std::tan(glm::radians(15.0));
    for (int y = 0; y < 40; ++y) {
        for (int x = 4; x < 54; ++x) {
            // Eye (32, 32, 92): x + z = (32 + d * a) + (92 - d) = 64, so d = 60 / (1 - a).
            // Centres of voxels lie on this plane, so the depth planes end up behind it.
            const double a = (x + 0.5 - 30) / focal;
            EXPECT_NEAR(picture.depth(x, y), 60 / (1 - a), 1.2) << x << ", " << y;
        }
    }
}

TEST(ReferenceRenderer, PointsThatFaceAwayAreNotDrawnWhereBacksAreHidden) {
    Camera camera = camera_in_front({8, 8, 8}, 50);
    camera.backs = Backs::hide;
    EXPECT_EQ(draw(make_wall(4, 8, {0, 0, -1}), camera).covered(), 0U);
    EXPECT_GT(draw(make_wall(4, 8, {0, 0, 1}), camera).covered(), 300U);
}

TEST(ReferenceRenderer, TwoSidedPointsAreLitAndDrawnFromBothSides) {
    Model model = make_wall(4, 8, {0, 0, 1}, true);
    model.parameters.lights = default_lights(UpAxis::y); // stay with the model
    Camera camera = camera_in_front({8, 8, 8.5}, 50);
    const Picture front = draw(model, camera);
    camera.position.z = 8.5 - 50;
    const Picture back = draw(model, camera);
    EXPECT_EQ(front.covered(), back.covered());
    EXPECT_NEAR(front.depth(32, 32), 50, 0.3);
    EXPECT_NEAR(back.depth(32, 32), 50, 0.3);
    // The key light reaches the front. The back gets only ambient light: 0.2 of 0.8 grey.
    EXPECT_GT(front.colour(32, 32)[0], back.colour(32, 32)[0] + 40);
    EXPECT_GT(back.colour(32, 32)[0], 80);
}

TEST(ReferenceRenderer, NearerPointsHideFartherOnesInAnyOrder) {
    // One voxel in each of the eight octants; the eye looks through them from each side.
    std::vector<TestVoxel> voxels;
    for (std::uint32_t i = 0; i < 8; ++i)
        voxels.push_back({{i & 1 ? 8U : 7U, i & 2 ? 8U : 7U, i & 4 ? 8U : 7U}, {0, 0, 1}, true});
    const Model model = make_test_model(4, voxels);
    for (const double side : {-1.0, 1.0}) {
        Camera camera;
        camera.focal_point = {8, 8, 8};
        camera.position = {8, 8, 8 + side * 20};
        const Picture picture = draw(model, camera);
        EXPECT_NEAR(picture.depth(28, 28), 19.5, 0.1);
        EXPECT_NEAR(picture.depth(36, 36), 19.5, 0.1);
    }
}

TEST(ReferenceRenderer, SplatsAtTheBorderAreClippedNotDropped) {
    const Model model = make_wall(5, 10);
    // So near that each border of the picture cuts splats of many pixels.
    for (const glm::dvec2 shift : {glm::dvec2(0, 0), glm::dvec2(0.3, -0.4), glm::dvec2(-0.45, 0.2)}) {
        const Camera camera = camera_in_front({16 + shift.x, 16 + shift.y, 10.5}, 6);
        EXPECT_EQ(draw(model, camera, {}, 200, 90).covered(), 200U * 90U);
    }
    // Only the edge of a disc is in the picture.
    const Picture edge = draw(make_test_model(4, {{{7, 7, 7}}}), camera_in_front({7.5 + 3.4, 7.5, 7.5}, 10));
    EXPECT_GT(edge.covered(), 0U);
    EXPECT_LT(edge.covered(), 200U);
}

TEST(ReferenceRenderer, SplatsCutByTheRightBorderStayOutOfTheNextRow) {
    const Model model = make_test_model(4, {{{8, 8, 8}}});
    for (const int width : {100, 101})
        for (int step = 0; step < 40; ++step) {
            const double half_width = 10 * std::tan(kDefaultViewAngle / 2) * width / 60;
            const Picture picture =
                draw(model, camera_in_front({8.5 - half_width - 0.8 + 0.05 * step, 8.5, 8.5}, 10), {}, width, 60);
            for (int y = 0; y < 60; ++y)
                EXPECT_EQ(picture.depth(0, y), kEmpty) << "width " << width << ", step " << step << ", row " << y;
        }
}

TEST(ReferenceRenderer, PicturesDoNotDependOnTheUnitOfTheScan) {
    Model model = make_wall(4, 8);
    const Picture metres = draw(model, camera_in_front({8, 8, 8.5}, 20));
    for (const double unit : {1e-30, 1e-12, 1e8, 1e30}) {
        Camera camera = camera_in_front({8, 8, 8.5}, 20);
        model.parameters.grid.voxel_size = unit;
        camera.position *= unit;
        camera.focal_point *= unit;
        const Picture picture = draw(model, camera);
        EXPECT_EQ(picture.covered(), metres.covered()) << unit;
        EXPECT_EQ(picture.target.colour, metres.target.colour) << unit;
    }
}

TEST(ReferenceRenderer, PicturesOfAnyShapeAreFilled) {
    const Model model = make_wall(6, 20);
    for (const glm::ivec2 size :
         {glm::ivec2(1, 1), glm::ivec2(1, 7), glm::ivec2(7, 1), glm::ivec2(2, 3), glm::ivec2(33, 5)})
        EXPECT_EQ(draw(model, camera_in_front({32, 32, 20.5}, 15), {}, size.x, size.y).covered(),
                  static_cast<std::size_t>(size.x * size.y));
}

TEST(ReferenceRenderer, PointsBehindTheEyeAreLeftOut) {
    const Model model = make_test_model(4, {{{8, 8, 2}}, {{8, 8, 8}}, {{8, 8, 14}}});
    Camera camera = camera_in_front({8.5, 8.5, 2.5}, 6); // the eye is inside the middle voxel
    const Picture picture = draw(model, camera);
    EXPECT_EQ(picture.drawn.drawn_points, 2U);
    EXPECT_NEAR(picture.depth(32, 32), 0, 0.1);
    camera.position.z = 1;
    camera.focal_point.z = 0; // everything is behind
    EXPECT_EQ(draw(model, camera).covered(), 0U);
}

TEST(ReferenceRenderer, BackgroundIsGreyOrTransparentOrChosen) {
    const Model model = make_test_model(4, {{{7, 7, 7}}});
    const Camera camera = camera_in_front({7.5, 7.5, 7.5}, 20);
    EXPECT_EQ(draw(model, camera).colour(0, 0), (Rgba8{51, 51, 51, 255}));
    const Picture clear = draw(model, camera, {.background = {0, 0, 0, 0}});
    EXPECT_EQ(clear.colour(0, 0), (Rgba8{0, 0, 0, 0}));
    EXPECT_EQ(clear.colour(32, 32)[3], 255);
    EXPECT_EQ(clear.depth(0, 0), kEmpty);
}

TEST(ReferenceRenderer, ShadesAKnownNormalWithAKnownLight) {
    Model model = make_wall(4, 8);
    model.parameters.lights = {Light{.direction = {0, 0, -1}}};
    // 0.8 grey is 0.604 of full light; ka + kd + ks = 1 in the middle of the picture.
    EXPECT_NEAR(draw(model, camera_in_front({8, 8, 8}, 50)).colour(32, 32)[0], 204, 1);
    model.parameters.lights[0].direction = {0, 0, 1}; // from behind: ambient, 0.2 x 0.604
    EXPECT_NEAR(draw(model, camera_in_front({8, 8, 8}, 50)).colour(32, 32)[0], 97, 1);
}

TEST(ReferenceRenderer, PointColoursAreUsedUnlessIgnored) {
    Model model = make_wall(4, 8);
    model.parameters.lights = {Light{.direction = {0, 0, -1}}};
    model.parameters.attributes.colour = ColourFormat::rgb888;
    PointAttributes &points = model.levels.back().points;
    points.colours.resize(points.size() * 3);
    for (std::size_t i = 0; i < points.size(); ++i)
        set_point_colour(points, i, ColourFormat::rgb888, {250, 100, 10});
    average_levels(model, 1);
    const Camera camera = camera_in_front({8, 8, 8}, 50);
    const Rgba8 colour = draw(model, camera).colour(32, 32);
    EXPECT_NEAR(colour[0], 250, 2);
    EXPECT_NEAR(colour[1], 100, 2);
    EXPECT_NEAR(colour[2], 10, 2);
    EXPECT_NEAR(draw(model, camera, {.point_colours = false}).colour(32, 32)[2], 204, 1);
}

TEST(ReferenceRenderer, ShadowValuesScaleTheirLight) {
    Model model = make_wall(4, 8);
    model.parameters.lights = {Light{.direction = {0, 0, -1}}};
    model.parameters.attributes.lights = 1;
    model.parameters.attributes.shadow_bits[0].fill(2);
    PointAttributes &points = model.levels.back().points;
    points.shadows[0].assign(points.size(), 3); // lit
    average_levels(model, 1);
    const Camera camera = camera_in_front({8, 8, 8}, 50);
    EXPECT_NEAR(draw(model, camera).colour(32, 32)[0], 204, 1);
    model.levels.back().points.shadows[0].assign(points.size(), 0);
    EXPECT_NEAR(draw(model, camera).colour(32, 32)[0], 97, 1);
}

TEST(ReferenceRenderer, PointLightsShineFromTheirPlace) {
    Model model = make_wall(5, 8);
    model.parameters.lights = {Light{.kind = LightKind::point, .position = {4, 16, 12}}};
    const Picture picture = draw(model, camera_in_front({16, 16, 8}, 60));
    EXPECT_GT(picture.colour(10, 32)[0], picture.colour(54, 32)[0] + 30);
    model.parameters.lights[0] =
        Light{.kind = LightKind::spot, .position = {4, 16, 20}, .direction = {0, 0, -1}, .exponent = 20};
    const Picture spot = draw(model, camera_in_front({16, 16, 8}, 60));
    EXPECT_GT(spot.colour(9, 32)[0], 180);
    EXPECT_NEAR(spot.colour(54, 32)[0], 97, 3);
}

TEST(ReferenceRenderer, EveryDetailLevelCoversTheWall) {
    const Model model = make_wall(6, 20);
    const Camera camera = camera_in_front({32, 32, 16}, 80);
    for (int level = 3; level <= 6; ++level) {
        const Picture picture = draw_level(model, camera, level);
        EXPECT_EQ(picture.drawn.level, level);
        EXPECT_EQ(picture.drawn.points, std::uint64_t{1} << (2 * level));
        EXPECT_EQ(picture.covered(), 64U * 64U) << level;
    }
    EXPECT_EQ(draw_level(model, camera_in_front({32, 32, 16}, 400), 0).drawn.drawn_points, 1U);
    EXPECT_EQ(draw_level(model, camera_in_front({32, 32, 16}, 400), 1).drawn.drawn_points, 4U);
    EXPECT_EQ(draw_level(model, camera, 99).drawn.level, 6);
}

TEST(ReferenceRenderer, DrawsTheLoadedPartOfAModel) {
    Model model = make_wall(6, 20);
    model.levels.resize(5);
    EXPECT_EQ(draw(model, camera_in_front({32, 32, 16}, 80)).drawn.level, 4);
}

TEST(ReferenceRenderer, GivesTheSamePictureTwice) {
    const Model model = make_wall(6, 20, {0.3, 0.2, 1});
    const Camera camera = camera_in_front({32, 32, 20}, 90);
    EXPECT_EQ(draw(model, camera).target.colour, draw(model, camera).target.colour);
}

// A bowl seen from above its rim in strong perspective: the concave inside must not lose a wall.
TEST(ReferenceRenderer, ConcaveWallsStayInPerspective) {
    std::vector<TestVoxel> voxels; // the five inner faces of a box, open towards +Z
    for (std::uint32_t a = 0; a < 32; ++a) {
        for (std::uint32_t b = 0; b < 32; ++b) {
            voxels.push_back({{0, a, b}, {1, 0, 0}});
            voxels.push_back({{31, a, b}, {-1, 0, 0}});
            if (a > 0 && a < 31) {
                voxels.push_back({{a, 0, b}, {0, 1, 0}});
                voxels.push_back({{a, 31, b}, {0, -1, 0}});
                if (b > 0 && b < 31)
                    voxels.push_back({{a, b, 0}, {0, 0, 1}});
            }
        }
    }
    const Model model = make_test_model(5, voxels);
    Camera camera = camera_in_front({16, 16, 0}, 40);
    camera.view_angle = glm::radians(60.0);
    const Picture picture = draw(model, camera, {}, 120, 120);
    // Inside the image of the rim every pixel shows a wall or the floor.
    const double rim = 15 * 60 / std::tan(glm::radians(30.0)) / 8.5;
    const int from = std::max(0, static_cast<int>(std::ceil(60 - rim)));
    for (int y = from; y < 120 - from; ++y)
        for (int x = from; x < 120 - from; ++x)
            EXPECT_NE(picture.depth(x, y), kEmpty) << x << ", " << y;
}

} // namespace
} // namespace pbm
