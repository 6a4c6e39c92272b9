// Shadows of points: simple scenes, every kind of light, odd lights and odd models.
#include "pbm_format/hashes/hash.h"
#include "pbm_surface/carried_offsets.h"
#include "unit/bake/test_scenes.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>

namespace pbm {
namespace {

using test::lamp;
using test::sun;
using test::VoxelScene;

// A floor at height 4 and a roof of 16x16 voxels at height 24 over its middle.
VoxelScene floor_and_roof() {
    VoxelScene scene;
    scene.add_sheet(0, 64, 0, 64, 4);
    scene.add_sheet(24, 40, 24, 40, 24, true);
    return scene;
}

Bytes bake(const Model &model, const Light &light, const ShadowOptions &options = {}) {
    return bake_light(ShadowCasters(model, 1), light, options);
}

// A floor voxel is lit if the ray from it to the light passes outside the roof. Rays within a voxel of the roof's edge
// are not compared.
void expect_shadow_of_roof(const VoxelScene &scene, const Bytes &lit, const Light &light) {
    std::size_t wrong = 0, shadowed = 0;
    for (int z = 0; z < 64; ++z)
        for (int x = 0; x < 64; ++x) {
            const double place[3] = {x + 0.5, 4.5, z + 0.5};
            double way[3];
            for (std::size_t axis = 0; axis < 3; ++axis)
                way[axis] = light.kind == LightKind::directional
                                ? static_cast<double>(-light.direction[axis])
                                : static_cast<double>(light.position[axis]) - place[axis];
            const double step = 20 / way[1];
            const double outside =
                std::max(std::abs(place[0] + step * way[0] - 32), std::abs(place[2] + step * way[2] - 32)) - 8;
            if (std::abs(outside) < 1)
                continue;
            shadowed += outside < 0 ? 1 : 0;
            wrong += (lit[scene.index(x, 4, z)] != 0) != (outside > 0) ? 1 : 0;
        }
    EXPECT_EQ(wrong, 0U);
    EXPECT_GT(shadowed, 100U);
}

TEST(Shadows, ARoofShadowsTheFloorUnderEveryKindOfLight) {
    const VoxelScene scene = floor_and_roof();
    const Model model = scene.model();
    Light spot = lamp({50, 150, 20});
    spot.kind = LightKind::spot;
    spot.direction = sun({-18, -140, 12}).direction;
    for (const Light &light : {sun({0, -1, 0}), sun({0.5, -1, 0.25}), sun({-0.9, -1, 0.9}), lamp({32, 200, 32}),
                               lamp({20, 60, 44}), lamp({10, 40, 60}), spot}) {
        SCOPED_TRACE(testing::PrintToString(light.position) + testing::PrintToString(light.direction));
        expect_shadow_of_roof(scene, bake(model, light), light);
    }
}

TEST(Shadows, TheSideOfASphereTowardsTheLightIsLit) {
    VoxelScene scene;
    scene.add_sphere({31.3, 32.1, 32.7}, 25);
    const Model model = scene.model();
    for (const Light &light : {sun({1, -2, -0.5}), sun({0, 0, -1}), lamp({90, 90, 90}), lamp({33, 80, 32})}) {
        const Bytes lit = bake(model, light);
        const ShadowCasters casters(model, 1);
        std::size_t facing = 0, shadowed = 0;
        for (std::size_t b = 0; b + 1 < casters.bricks().size(); ++b)
            for (std::size_t i = casters.bricks()[b].first_point; i < casters.bricks()[b + 1].first_point; ++i) {
                const auto place = morton_decode(casters.places()[i]);
                const UnitVector &n = normal_table()[casters.normals()[i]];
                double towards = 0, length = 0;
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    const double way = light.kind == LightKind::directional
                                           ? static_cast<double>(-light.direction[axis])
                                           : static_cast<double>(light.position[axis]) -
                                                 (8 * casters.bricks()[b].corner[axis] + place[axis] + 0.5);
                    towards += way * n[axis];
                    length += way * way;
                }
                if (towards < 0.05 * std::sqrt(length))
                    continue;
                ++facing;
                shadowed += lit[i] == 0 ? 1 : 0;
            }
        EXPECT_GT(facing, 2000U);
        EXPECT_EQ(shadowed, 0U);
    }
}

TEST(Shadows, ARodOfOneVoxelShadows) {
    VoxelScene scene;
    scene.add_sheet(0, 64, 0, 64, 4);
    for (int x = 10; x < 54; ++x)
        scene.add(x, 20, 32, {0, 1, 0}, true);
    const Bytes lit = bake(scene.model(), sun({0, -1, 0}));
    for (int x = 12; x < 52; ++x) {
        EXPECT_EQ(lit[scene.index(x, 4, 32)], 0);
        EXPECT_EQ(lit[scene.index(x, 4, 30)], 1);
        EXPECT_EQ(lit[scene.index(x, 4, 34)], 1);
    }
}

TEST(Shadows, NoLightLeaksUnderAWallThatStandsOnTheFloor) {
    VoxelScene scene;
    scene.add_sheet(0, 64, 0, 64, 4);
    for (int y = 5; y < 30; ++y)
        for (int z = 10; z < 54; ++z)
            scene.add(32, y, z, {1, 0, 0}, true);
    const Bytes lit = bake(scene.model(), sun({-1, -1, 0}));
    for (int z = 12; z < 52; ++z)
        for (int x = 10; x < 31; ++x)
            EXPECT_EQ(lit[scene.index(x, 4, z)], 0) << x << " " << z;
    EXPECT_EQ(lit[scene.index(40, 4, 32)], 1);
}

// Whether a floor at height 4 is lit below sheets at other heights.
bool floor_is_lit(std::initializer_list<int> above, std::array<double, 3> normal, bool floor_two_sided = false) {
    VoxelScene scene;
    scene.add_sheet(0, 64, 0, 64, 4, floor_two_sided);
    for (const int y : above)
        for (int z = 0; z < 64; ++z)
            for (int x = 0; x < 64; ++x)
                scene.add(x, y, z, normal);
    return bake(scene.model(), sun({0.25, -1, 0}))[scene.index(20, 4, 20)] != 0;
}

TEST(Shadows, WhereScansLieOnEachOtherTheOutermostReceivesThem) {
    EXPECT_TRUE(floor_is_lit({5}, {0, 1, 0}));
    EXPECT_TRUE(floor_is_lit({5, 6}, {0, 1, 0}));
    EXPECT_FALSE(floor_is_lit({8}, {0, 1, 0})) << "a roof";
    EXPECT_FALSE(floor_is_lit({5, 6}, {0, -1, 0})) << "the other side of something";
    EXPECT_FALSE(floor_is_lit({5, 6}, {0, 1, 0}, true)) << "nobody knows which side of the floor is the outer one";
}

TEST(Shadows, PointsFacingAwayTakeTheValueAroundThem) {
    VoxelScene scene;
    scene.add_sheet(0, 64, 0, 64, 4);
    scene.add_sheet(0, 32, 0, 64, 30, true);
    scene.add(9, 5, 9, {0, -1, 0});  // next to a floor in shadow
    scene.add(51, 5, 9, {0, -1, 0}); // next to a lit floor
    const Bytes lit = bake(scene.model(), sun({0, -1, 0}));
    EXPECT_EQ(lit[scene.index(9, 5, 9)], 0);
    EXPECT_EQ(lit[scene.index(51, 5, 9)], 1);
}

// A roof of 48x48 voxels that faces up, and a floor of 16x16 below its middle that faces up, lit from below.
TEST(Shadows, AnOpenSheetIsLitFromItsBackWhereNothingElseIsBetween) {
    VoxelScene scene;
    scene.add_sheet(24, 40, 24, 40, 4);
    scene.add_sheet(8, 56, 8, 56, 24);
    for (const Light &light : {sun({0, 1, 0}), lamp({32, -1000, 32})}) {
        const Bytes open = bake(scene.model(false), light), closed = bake(scene.model(true), light);
        EXPECT_EQ(std::accumulate(closed.begin(), closed.end(), 0), 0);
        for (int x = 8; x < 56; ++x)
            if (std::abs(std::abs(x + 0.5 - 32) - 8) > 1) { // not within a voxel of the floor's edge
                EXPECT_EQ(open[scene.index(x, 24, 32)], x < 24 || x >= 40 ? 1 : 0) << x;
            }
        EXPECT_EQ(open[scene.index(32, 4, 32)], 1);
    }
}

TEST(Shadows, TheInsideOfAHalfCylinderIsNotInItsOwnShadow) {
    VoxelScene scene;
    for (int i = 0; i < 720; ++i)
        for (int y = 8; y < 56; ++y) {
            const double x = std::cos(i * 3.14159265 / 720), z = std::sin(i * 3.14159265 / 720);
            scene.add(static_cast<int>(32 + 24 * x), y, static_cast<int>(16 + 24 * z), {x, 0, z});
        }
    const Bytes lit = bake(scene.model(false), sun({0, 0, 1})); // onto the inside
    EXPECT_GT(std::accumulate(lit.begin(), lit.end(), std::size_t{0}), lit.size() * 98 / 100);
}

// Whether a light comes from the one side of an open sheet or from the other, it leaves no other shadow.
TEST(Shadows, OfASheetOnTheGroundAreTheSameForBothOfItsSides) {
    Image masks[2];
    for (const int side : {0, 1}) {
        VoxelScene scene;
        for (int x = 24; x < 40; ++x)
            for (int z = 24; z < 40; ++z)
                scene.add(x, 24, z, {0, side == 0 ? 1.0 : -1.0, 0});
        const Model model = scene.model(false);
        masks[side] =
            bake_ground(ShadowCasters(model, 1), sun({0.3, -1, 0}),
                        {.centre = {32, 4, 32}, .half_edge = 32, .material = 0, .texture = {}}, 64, {.maps = 16});
    }
    int most = 0;
    for (std::size_t i = 0; i < masks[0].texels.size(); ++i)
        most = std::max(most, std::abs(masks[0].texels[i] - masks[1].texels[i]));
    EXPECT_LE(most, 16); // of 255: four of the 64 rays of a texel at the edge
    EXPECT_EQ(*std::min_element(masks[0].texels.begin(), masks[0].texels.end()), 0);
}

TEST(Shadows, PenumbrasAreAsWideAsTheLightSaysAndSmooth) {
    VoxelScene scene;
    scene.add_sheet(0, 64, 0, 64, 4);
    scene.add_sheet(0, 32, 0, 64, 44, true);
    // 40 voxels below the edge at x = 32: the penumbra is 0.3 * 40 = 12 voxels wide.
    const Bytes lit = bake(scene.model(), sun({0, -1, 0}), {.maps = 128, .bits = 8, .light_size = 0.3});
    EXPECT_EQ(lit[scene.index(24, 4, 32)], 0);
    EXPECT_EQ(lit[scene.index(40, 4, 32)], 255);
    EXPECT_NEAR(lit[scene.index(32, 4, 32)], 128, 32);
    for (int x = 24; x < 40; ++x)
        EXPECT_LE(lit[scene.index(x, 4, 32)], lit[scene.index(x + 1, 4, 32)] + 8);
    EXPECT_GT(lit[scene.index(28, 4, 32)], 5);
    EXPECT_LT(lit[scene.index(35, 4, 32)], 250);
    const Bytes two_bits = bake(scene.model(), sun({0, -1, 0}), {.maps = 16, .bits = 2, .light_size = 0.3});
    EXPECT_EQ(*std::max_element(two_bits.begin(), two_bits.end()), 3);
}

TEST(Shadows, ALightWithinAModelReachesAllThatItSees) {
    VoxelScene scene;
    scene.add_sphere({32, 32, 32}, 20);
    Model model = scene.model();
    // All points face outwards: the light inside reaches none.
    const Bytes dark = bake(model, lamp({32, 32, 32}));
    EXPECT_EQ(std::accumulate(dark.begin(), dark.end(), 0), 0);
    for (std::uint16_t &normal : model.levels.back().points.normals)
        normal = static_cast<std::uint16_t>(normal | kTwoSidedBit);
    for (const auto &place : {std::array<float, 3>{32, 32, 32}, {28, 35, 30}, {32, 45, 32}}) {
        const Bytes lit = bake(model, lamp(place));
        EXPECT_GE(std::accumulate(lit.begin(), lit.end(), std::size_t{0}), lit.size() * 999 / 1000);
    }
}

TEST(Shadows, ALightAtAPointOrBesideItIsDefined) {
    const VoxelScene scene = floor_and_roof();
    const Model model = scene.model();
    for (const auto &place : {std::array<float, 3>{10.5F, 4.5F, 10.5F}, {32, 24.5F, 32}, {32, 24, 32}, {0, 0, 0}})
        EXPECT_EQ(bake(model, lamp(place)).size(), model.point_count());
    // A light just above the floor lights the floor around it.
    const Bytes lit = bake(model, lamp({10.5F, 6.5F, 10.5F}));
    EXPECT_EQ(lit[scene.index(12, 4, 12)], 1);
    EXPECT_EQ(lit[scene.index(8, 4, 10)], 1);
}

TEST(Shadows, APointLightFarAwayIsADirectionalOne) {
    const VoxelScene scene = floor_and_roof();
    const Model model = scene.model();
    const Bytes parallel = bake(model, sun({-1, -2, -0.5}));
    for (const float distance : {1e5F, 1e9F, 1e30F, 3e38F}) {
        const Bytes lit = bake(model, lamp({distance * 0.5F, distance, distance * 0.25F}));
        std::size_t different = 0;
        for (std::size_t i = 0; i < lit.size(); ++i)
            different += lit[i] != parallel[i] ? 1 : 0;
        EXPECT_LE(different, lit.size() / 100) << distance;
    }
}

TEST(Shadows, BehindASpotLightAllIsInShadow) {
    const VoxelScene scene = floor_and_roof();
    Light spot = lamp({32, 100, 32});
    spot.kind = LightKind::spot;
    spot.direction = {0, 1, 0};
    const Bytes lit = bake(scene.model(), spot);
    EXPECT_EQ(std::accumulate(lit.begin(), lit.end(), 0), 0);
}

TEST(Shadows, ModelsOfOneVoxelAndOfOneSheetAreLit) {
    VoxelScene one;
    one.add(63, 0, 63, {0, 1, 0});
    VoxelScene sheet;
    sheet.add_sheet(0, 64, 0, 64, 63);
    for (const Light &light : {sun({0.3, -1, 0.2}), lamp({20, 500, 30}), lamp({30, 66, 30})})
        for (const VoxelScene *scene : {&one, &sheet}) {
            const Bytes lit = bake(scene->model(), light);
            EXPECT_EQ(std::accumulate(lit.begin(), lit.end(), std::size_t{0}), lit.size());
        }
    const Bytes below = bake(one.model(), sun({0, 1, 0}));
    EXPECT_EQ(below, Bytes{0});
    // The light sees the sheet edge-on: its projected extent is zero, which must not cause a division by zero.
    EXPECT_EQ(bake(sheet.model(), sun({1, 0, 0})).size(), 64U * 64U);
}

// A scene with soft shadows under a sun, a lamp close by and one far away.
const Model &soft_scene() {
    static const Model model = [] {
        VoxelScene scene = floor_and_roof();
        scene.add_sphere({20, 40, 44}, 9);
        return scene.model();
    }();
    return model;
}
const std::array kSoftLights{sun({0.5, -1, 0.25}), lamp({20, 60, 44}), lamp({90, 150, 20})};
const ShadowOptions kSoft{.maps = 5, .bits = 4, .light_size = 0.1, .threads = 1};

TEST(Shadows, BytesAreTheSameForAnyNumberOfThreads) {
    for (const Light &light : kSoftLights) {
        const Bytes one = bake(soft_scene(), light, kSoft);
        for (const int threads : {2, 3, 7}) {
            ShadowOptions more = kSoft;
            more.threads = threads;
            EXPECT_EQ(bake_light(ShadowCasters(soft_scene(), threads), light, more), one);
        }
    }
}

// The same for every compiler and machine. Every constant of the baker is part of them.
TEST(Shadows, HaveTheirGoldenBytes) {
    Bytes all;
    for (const Light &light : kSoftLights) {
        const Bytes one = bake(soft_scene(), light, kSoft);
        all.insert(all.end(), one.begin(), one.end());
    }
    EXPECT_EQ(hash64(all), 5645859874839032164U);
}

// Nothing in it is flat or hard: a curved floor, open on its other side, and a ball; lights that graze it, lie within
// it, close by, and so far away that they are parallel or just not.
TEST(Shadows, OfCurvedSurfacesHaveTheirGoldenBytes) {
    VoxelScene scene;
    for (int z = 0; z < 64; ++z)
        for (int x = 0; x < 64; ++x) {
            const int u = x - 32, v = z - 20;
            scene.add(x, 6 + (u * u + v * v) / 60, z, {-u / 30.0, 1, -v / 30.0}, (x + z) % 7 == 0);
        }
    scene.add_sphere({31, 40, 30}, 8);
    Bytes all;
    for (const bool closed : {false, true}) {
        const Model model = scene.model(closed);
        for (const Light &light : {sun({1, -0.25, 0.1}), sun({0.1, 1, 0}), lamp({30, 26, 30}), lamp({32, 41, 33}),
                                   lamp({32, 120, 40}), lamp({20000, 60000, 10000})}) {
            const Bytes lit = bake(model, light, kSoft);
            all.insert(all.end(), lit.begin(), lit.end());
        }
    }
    EXPECT_EQ(hash64(all), 16051042805983464012U);
}

// The disc of a voxel of radius 0.87 reaches 0.83 x 0.87 = 0.72 voxels far: just over the corners of its voxel. The
// nearest texel to a voxel beside it lies anywhere in that voxel, so the disc's share of it is in shadow: 16 %, with a
// disc of 0.87 voxels 31 %.
TEST(Shadows, DiscsOfDensePointsReachLittleBeyondTheirVoxel) {
    VoxelScene scene;
    scene.add_sheet(0, 64, 0, 64, 4);
    scene.add(32, 30, 32, {0, 1, 0}, true);
    const Bytes lit = bake(scene.model(), sun({0, -1, 0}), {.maps = 255, .bits = 8, .light_size = 1e-6});
    EXPECT_EQ(lit[scene.index(32, 4, 32)], 0);
    for (const auto &[x, z] : {std::pair(31, 32), {33, 32}, {32, 31}, {32, 33}})
        EXPECT_NEAR(lit[scene.index(x, 4, z)] / 255.0, 0.84, 0.04) << x << " " << z;
    EXPECT_EQ(lit[scene.index(34, 4, 32)], 255);
}

TEST(Shadows, ProgressEndsAtOneAndAStopGivesNothing) {
    const Model model = floor_and_roof().model();
    std::vector<double> told;
    bake(model, sun({0, -1, 0}), {.maps = 3, .progress = [&](double done) { told.push_back(done); }});
    ASSERT_EQ(told.size(), 3U);
    EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
    EXPECT_DOUBLE_EQ(told.back(), 1);
    const std::atomic<bool> stop = true;
    EXPECT_TRUE(bake(model, sun({0, -1, 0}), {.stop = &stop}).empty());
}

} // namespace
} // namespace pbm
