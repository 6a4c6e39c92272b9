// Rays against triangles: the tree against testing every triangle, and shadows with a known answer.
#include "pbm_format/hashes/hash.h"
#include "unit/bake/test_scenes.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace pbm {
namespace {

using test::lamp;
using test::sun;
using test::VoxelScene;

using Triangle = TriangleTree::Triangle;
using Point = std::array<double, 3>;

constexpr float kAnyWay = std::numeric_limits<float>::max();

TriangleTree tree_of(const std::vector<Triangle> &triangles, int threads = 1) {
    return {triangles.size(), [&](std::size_t i) { return triangles[i]; }, threads};
}

// The same triangles with every standard library.
std::vector<Triangle> scattered_triangles(std::size_t count, std::mt19937 &random) {
    const auto between = [&](float low, float high) {
        return low + (high - low) * static_cast<float>(random() >> 8) * 0x1p-24F;
    };
    std::vector<Triangle> triangles(count);
    for (Triangle &triangle : triangles) {
        const Position at{between(0, 32), between(0, 32), between(0, 32)};
        for (Position &place : triangle)
            place = {at[0] + between(-2, 2), at[1] + between(-2, 2), at[2] + between(-2, 2)};
    }
    return triangles;
}

Point minus(const Point &a, const Point &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Point &a, const Point &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point cross(const Point &a, const Point &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Point wide(const Position &a) {
    return {static_cast<double>(a[0]), static_cast<double>(a[1]), static_cast<double>(a[2])};
}

// How far inside the triangle the line passes, as a volume (negative: outside), and the ray parameter.
std::pair<double, double> passes(const Triangle &triangle, const Point &from, const Point &way) {
    const Point a = minus(wide(triangle[0]), from), b = minus(wide(triangle[1]), from),
                c = minus(wide(triangle[2]), from);
    const double ab = dot(way, cross(a, b)), bc = dot(way, cross(b, c)), ca = dot(way, cross(c, a));
    const Point normal = cross(minus(b, a), minus(c, a));
    const double inside = std::max(std::min({ab, bc, ca}), std::min({-ab, -bc, -ca}));
    return {inside, dot(a, normal) / dot(way, normal)};
}

TEST(TriangleTree, BlocksWhatOneTriangleAfterTheOtherBlocks) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> place(-4, 36), way(-1, 1);
    for (const std::size_t count : {0U, 1U, 3U, 4U, 5U, 16U, 17U, 64U, 65U, 700U}) {
        const std::vector<Triangle> triangles = scattered_triangles(count, random);
        const TriangleTree tree = tree_of(triangles);
        EXPECT_EQ(tree.empty(), count == 0);
        std::size_t blocked = 0;
        for (int i = 0; i < 500; ++i) {
            const Position from{place(random), place(random), place(random)},
                towards{way(random), way(random), way(random)};
            for (const float reach : {5.0F, kAnyWay}) {
                bool expected = false, close = false;
                for (const Triangle &triangle : triangles) {
                    const auto [inside, at] = passes(triangle, wide(from), wide(towards));
                    const double limit = static_cast<double>(reach);
                    close = close || std::abs(inside) < 1e-4 || std::abs(at) < 1e-4 || std::abs(at - limit) < 1e-4;
                    expected = expected || (inside > 0 && at > 0 && at < limit);
                }
                if (close)
                    continue;
                EXPECT_EQ(tree.blocks(from, towards, reach), expected) << count;
                blocked += expected ? 1 : 0;
            }
        }
        if (count == 700) {
            EXPECT_GT(blocked, 100U);
        }
    }
}

TEST(TriangleTree, AlongAnAxisAndInTheTrianglesPlane) {
    const TriangleTree tree = tree_of({{{{1, 1, 4}, {5, 1, 4}, {1, 5, 4}}}});
    EXPECT_TRUE(tree.blocks({2, 2, 0}, {0, 0, 1}, 4.01F));
    EXPECT_FALSE(tree.blocks({2, 2, 0}, {0, 0, 1}, 3.99F));
    EXPECT_FALSE(tree.blocks({2, 2, 0}, {0, 0, -1}, kAnyWay));
    EXPECT_FALSE(tree.blocks({4, 4, 0}, {0, 0, 1}, kAnyWay));
    EXPECT_FALSE(tree.blocks({0, 2, 4}, {1, 0, 0}, kAnyWay)) << "seen from its edge it has no area";
}

// Both halves face down.
Triangle rectangle_half(bool second, float x0, float x1, float z0, float z1, float y) {
    return second ? Triangle{{{x1, y, z1}, {x0, y, z1}, {x1, y, z0}}}
                  : Triangle{{{x0, y, z0}, {x1, y, z0}, {x0, y, z1}}};
}

Triangle turned(const Triangle &triangle) { return {triangle[0], triangle[2], triangle[1]}; }

TEST(TriangleTree, TheLastLayerIsBeforeTheOtherSide) {
    std::vector<Triangle> triangles;
    for (const float y : {1.0F, 1.5F, 2.25F, 4.0F})
        triangles.push_back(rectangle_half(false, 0, 8, 0, 8, y));
    const TriangleTree layers = tree_of(triangles);
    EXPECT_EQ(layers.last_layer({2, 0.75F, 2}, {0, 1, 0}, 0.5F, 2), 1.5F);
    EXPECT_EQ(layers.last_layer({2, 0.75F, 2}, {0, 1, 0}, 0.5F, 9), 3.25F);
    EXPECT_EQ(layers.last_layer({2, 0.75F, 2}, {0, 1, 0}, 0.2F, 9), std::nullopt) << "it starts too far below";
    EXPECT_EQ(layers.last_layer({7, 0.75F, 7}, {0, 1, 0}, 0.5F, 9), std::nullopt) << "beside them";
    triangles.push_back(turned(rectangle_half(false, 0, 8, 0, 8, 2)));
    const TriangleTree crack = tree_of(triangles);
    EXPECT_EQ(crack.last_layer({2, 0.75F, 2}, {0, 1, 0}, 0.5F, 9), 0.75F) << "what is above 2 is another surface";
    EXPECT_EQ(crack.last_layer({2, 1.75F, 2}, {0, 1, 0}, 0.5F, 9), 0.25F);
    EXPECT_EQ(tree_of({}).last_layer({2, 0, 2}, {0, 1, 0}, 1, 9), std::nullopt);
}

// Squared distance by sampling the triangle: never less than the true distance.
double searched_distance(const Triangle &triangle, const Point &from) {
    constexpr int kSteps = 60;
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= kSteps; ++i)
        for (int j = 0; i + j <= kSteps; ++j) {
            Point at{};
            for (std::size_t axis = 0; axis < 3; ++axis)
                at[axis] = (static_cast<double>(triangle[0][axis]) * (kSteps - i - j) +
                            static_cast<double>(triangle[1][axis]) * i + static_cast<double>(triangle[2][axis]) * j) /
                           kSteps;
            const Point apart = minus(at, from);
            best = std::min(best, dot(apart, apart));
        }
    return std::sqrt(best);
}

TEST(TriangleTree, NearestIsNearestOfAll) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> place(0, 32);
    const std::vector<Triangle> triangles = scattered_triangles(90, random);
    const TriangleTree tree = tree_of(triangles);
    for (int i = 0; i < 60; ++i) {
        const Position from{place(random), place(random), place(random)};
        double expected = std::numeric_limits<double>::infinity();
        for (const Triangle &triangle : triangles)
            expected = std::min(expected, searched_distance(triangle, wide(from)));
        const std::optional<Position> found = tree.nearest(from, 100);
        ASSERT_TRUE(found);
        const Point apart = minus(wide(*found), wide(from));
        const double distance = std::sqrt(dot(apart, apart));
        EXPECT_LE(distance, expected + 1e-4);
        EXPECT_GE(distance, expected - 0.1) << "the search's steps are up to 0.07 wide";
        EXPECT_FALSE(tree.nearest(from, static_cast<float>(distance * 0.999)));
    }
    EXPECT_FALSE(tree_of({}).nearest({1, 2, 3}, 100));
}

VoxelScene voxels_of_floor_and_roof() {
    VoxelScene scene;
    scene.add_sheet(0, 64, 0, 64, 4);
    scene.add_sheet(24, 40, 24, 40, 24, true);
    return scene;
}

std::vector<Triangle> faces_of_floor_and_roof() {
    std::vector<Triangle> triangles;
    for (const bool second : {false, true}) {
        triangles.push_back(rectangle_half(second, 0, 64, 0, 64, 4.8F));
        triangles.push_back(rectangle_half(second, 24, 40, 24, 40, 24.1F));
    }
    return triangles;
}

// A floor at height 4.8, in voxels with y = 4, and a roof of 16x16 voxels at height 24.1 over its middle.
struct FloorAndRoof {
    explicit FloorAndRoof(VoxelScene voxels = voxels_of_floor_and_roof()) : scene(std::move(voxels)) {}

    VoxelScene scene;
    Model model = scene.model();
    TriangleTree tree = tree_of(faces_of_floor_and_roof());
    ShadowCasters casters{model, 1};
    ShadowRays rays{casters, tree, 1};
};

TEST(ShadowRays, AShadowEndsWhereTheRayDoes) {
    const FloorAndRoof made;
    ASSERT_TRUE(made.rays.complete());
    const Light light = sun({0.25, -1, 0});
    const Bytes lit = bake_light(made.casters, light, {.rays = &made.rays});
    // The ray climbs from 4.8 + 0.25 to 24.1, so it shifts by 0.25 * 19.05 = 4.76 voxels.
    for (int x = 0; x < 64; ++x)
        EXPECT_EQ(lit[made.scene.index(x, 4, 30)], x + 0.5 > 24 + 4.76 && x + 0.5 < 40 + 4.76 ? 0 : 1) << x;
    EXPECT_EQ(lit[made.scene.index(30, 24, 30)], 1) << "the roof";
    const Bytes below = bake_light(made.casters, sun({0, 1, 0}), {.bits = 2, .rays = &made.rays});
    EXPECT_EQ(below[made.scene.index(30, 24, 30)], 0) << "two-sided, and the floor is below it";
    const Bytes lamplight = bake_light(made.casters, lamp({32, 44, 32}), {.bits = 2, .rays = &made.rays});
    EXPECT_EQ(lamplight[made.scene.index(32, 4, 32)], 0);
    EXPECT_EQ(lamplight[made.scene.index(2, 4, 2)], 3);
    const Bytes between = bake_light(made.casters, lamp({32, 14, 32}), {.rays = &made.rays});
    EXPECT_EQ(between[made.scene.index(32, 4, 32)], 1) << "what lies behind the light does not matter";
}

TEST(ShadowRays, ReachTheBacksOfOpenSurfacesAlone) {
    for (const bool closed : {false, true}) {
        FloorAndRoof made;
        made.model.parameters.closed = closed;
        const ShadowCasters casters(made.model, 1);
        const ShadowRays rays(casters, made.tree, 1);
        const Bytes below = bake_light(casters, sun({0.25, 1, 0}), {.rays = &rays});
        EXPECT_EQ(below[made.scene.index(30, 4, 30)], closed ? 0 : 1) << "the floor, which faces up";
        EXPECT_EQ(below[made.scene.index(30, 24, 30)], 0) << "the floor is below the roof";
    }
}

TEST(ShadowRays, ALightAtAPointOrFarAwayIsDefined) {
    const FloorAndRoof made;
    const ShadowOptions options{.rays = &made.rays};
    EXPECT_EQ(bake_light(made.casters, lamp({10.5F, 5.05F, 10.5F}), options).size(), made.casters.size());
    EXPECT_EQ(bake_light(made.casters, lamp({2.5e29F, -1e30F, 0}), options)[0], 0);
    EXPECT_EQ(bake_light(made.casters, lamp({-2.5e29F, 1e30F, 0}), options),
              bake_light(made.casters, sun({0.25, -1, 0}), options));
}

TEST(ShadowRays, APointWithoutATriangleLeavesAllToTheMaps) {
    VoxelScene scene = voxels_of_floor_and_roof();
    scene.add(60, 50, 60, {0, 1, 0});
    const FloorAndRoof made(std::move(scene));
    const TriangleTree none = tree_of({});
    const ShadowRays empty(made.casters, none, 1);
    EXPECT_FALSE(made.rays.complete());
    EXPECT_FALSE(empty.complete());
    const Light light = sun({0.25, -1, 0});
    EXPECT_EQ(bake_light(made.casters, light, {.rays = &made.rays}), bake_light(made.casters, light));
    EXPECT_EQ(bake_light(made.casters, light, {.rays = &empty}), bake_light(made.casters, light));
}

// Whether a floor at height 4.4, in voxels with y = 4, is lit below the triangles `above`.
bool floor_is_lit(const std::vector<Triangle> &above, bool two_sided = false) {
    VoxelScene scene;
    scene.add_sheet(0, 64, 0, 64, 4, two_sided);
    std::vector<Triangle> triangles = above;
    for (const bool second : {false, true})
        triangles.push_back(rectangle_half(second, 0, 64, 0, 64, 4.4F));
    const Model model = scene.model();
    const TriangleTree tree = tree_of(triangles);
    const ShadowCasters casters(model, 1);
    const ShadowRays rays(casters, tree, 1);
    return bake_light(casters, sun({0.25, -1, 0}), {.rays = &rays})[scene.index(20, 4, 20)] != 0;
}

TEST(ShadowRays, WhereScansLieOverEachOtherTheOutermostIsLit) {
    const auto layer = [](float y) { return rectangle_half(false, 0, 64, 0, 64, y); };
    EXPECT_TRUE(floor_is_lit({}));
    EXPECT_TRUE(floor_is_lit({layer(4.9F)})) << "in the same voxel";
    EXPECT_TRUE(floor_is_lit({layer(4.9F), layer(5.7F)}));
    EXPECT_FALSE(floor_is_lit({layer(9)})) << "a roof";
    EXPECT_FALSE(floor_is_lit({turned(layer(5)), layer(5.7F)})) << "a plate of its own close above";
    EXPECT_FALSE(floor_is_lit({layer(4.9F)}, true)) << "nobody knows which side of two is the outer one";
}

TEST(ShadowRays, PenumbrasAreAsWideAsTheLightSays) {
    const FloorAndRoof made;
    // From 5.05 up to 24.1: the penumbra is 0.4 * 19.05 = 7.6 voxels wide.
    const Bytes soft =
        bake_light(made.casters, sun({0, -1, 0}), {.maps = 200, .bits = 8, .light_size = 0.4, .rays = &made.rays});
    const auto at = [&](int x) { return soft[made.scene.index(x, 4, 32)] / 255.0; };
    EXPECT_EQ(at(10), 1);
    EXPECT_EQ(at(32), 0);
    for (int x = 11; x <= 32; ++x)
        EXPECT_LE(at(x), at(x - 1)) << x;
    EXPECT_EQ(at(19), 1);
    EXPECT_NEAR(at(22), 0.74, 0.05) << "the share of a disc beyond 0.39 of its radius";
    EXPECT_NEAR(at(25), 0.26, 0.05);
    EXPECT_EQ(at(28), 0);
    const Bytes by_lamp =
        bake_light(made.casters, lamp({32, 44, 32}), {.maps = 64, .bits = 8, .light_size = 4, .rays = &made.rays});
    EXPECT_EQ(by_lamp[made.scene.index(32, 4, 32)], 0);
    EXPECT_EQ(by_lamp[made.scene.index(2, 4, 2)], 255);
}

TEST(ShadowRays, SoftShadowsOfRaysAreThoseOfMaps) {
    const FloorAndRoof made;
    for (const Light &light : {sun({0.25, -1, 0}), lamp({40, 60, 30}), lamp({10, 20, 30})}) {
        const ShadowOptions maps{.maps = 64, .bits = 4, .light_size = light.kind == LightKind::point ? 6.0 : 0.3};
        ShadowOptions rays = maps;
        rays.rays = &made.rays;
        const Bytes by_maps = bake_light(made.casters, light, maps), by_rays = bake_light(made.casters, light, rays);
        double apart = 0;
        for (std::size_t i = 0; i < by_maps.size(); ++i)
            apart += std::abs(by_maps[i] - by_rays[i]) / 15.0;
        EXPECT_LT(apart / static_cast<double>(by_maps.size()), 0.02);
    }
}

// The shadows of 20,000 scattered triangles on a floor.
Bytes lit_below_triangles(int threads) {
    VoxelScene scene;
    scene.add_sheet(0, 64, 0, 64, 4);
    std::mt19937 random(3);
    std::vector<Triangle> triangles = scattered_triangles(20000, random);
    for (const bool second : {false, true})
        triangles.push_back(rectangle_half(second, 0, 64, 0, 64, 4.5F));
    const Model model = scene.model();
    const TriangleTree tree = tree_of(triangles, threads);
    const ShadowCasters casters(model, threads);
    const ShadowRays rays(casters, tree, threads);
    EXPECT_TRUE(rays.complete());
    return bake_light(casters, lamp({70, 20, 40}), {.rays = &rays, .threads = threads});
}

TEST(ShadowRays, BytesAreTheSameForAnyNumberOfThreads) {
    const Bytes expected = lit_below_triangles(1);
    EXPECT_GT(std::count(expected.begin(), expected.end(), 1), 500);
    EXPECT_GT(std::count(expected.begin(), expected.end(), 0), 500);
    for (const int threads : {2, 5})
        EXPECT_EQ(lit_below_triangles(threads), expected) << threads;
}

// A curved floor of triangles that cut its voxels anywhere, under lights that graze it.
TEST(ShadowRays, OnACurvedFloorGiveTheirGoldenBytes) {
    const auto height = [](int x, int z) {
        return 6.3F + static_cast<float>((x - 32) * (x - 32) + (z - 20) * (z - 20)) / 64;
    };
    VoxelScene scene;
    std::vector<Triangle> triangles;
    for (int z = 0; z < 64; ++z)
        for (int x = 0; x < 64; ++x) {
            scene.add(x, static_cast<int>(height(x, z)), z, {(32 - x) / 32.0, 1, (20 - z) / 32.0});
            const auto corner = [&](int i, int j) {
                return Position{static_cast<float>(x + i), height(x + i, z + j), static_cast<float>(z + j)};
            };
            triangles.push_back({corner(0, 0), corner(1, 0), corner(0, 1)});
            triangles.push_back({corner(1, 0), corner(1, 1), corner(0, 1)});
        }
    const Model model = scene.model();
    const TriangleTree tree = tree_of(triangles, 2);
    const ShadowCasters casters(model, 2);
    const ShadowRays rays(casters, tree, 2);
    Bytes all;
    for (const Light &light : {sun({1, -0.2, 0.1}), sun({-0.3, -0.1, 1}), lamp({30, 12, 30}), lamp({60, 40, 5})}) {
        const Bytes lit = bake_light(casters, light, {.maps = 8, .bits = 4, .light_size = 0.2, .rays = &rays});
        all.insert(all.end(), lit.begin(), lit.end());
    }
    EXPECT_EQ(hash64(all), 5305757033134886588U);
}

// The same for every compiler and machine.
TEST(ShadowRays, GiveTheirGoldenBytes) { EXPECT_EQ(hash64(lit_below_triangles(2)), 505809410370228365U); }

} // namespace
} // namespace pbm
