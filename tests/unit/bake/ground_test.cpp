// Shadows on the ground plane.
#include "pbm_format/hashes/hash.h"
#include "unit/bake/test_scenes.h"

#include <gtest/gtest.h>

#include <numbers>

namespace pbm {
namespace {

using test::lamp;
using test::sun;
using test::VoxelScene;

constexpr std::uint32_t kSize = 256;

// A square of edge 128 voxels below the scene; a texel is half a voxel wide. u runs along z, v along x.
GroundPlane plane_at(float height) {
    return {.centre = {32, height, 32}, .half_edge = 64, .material = 0, .texture = {}};
}

std::uint8_t at(const Image &image, double x, double z) {
    const auto texel = [](double place) { return static_cast<std::size_t>((place + 32) * 2); };
    return image.texels[texel(x) * image.width + texel(z)];
}

TEST(GroundShadow, ASphereCastsADiscWithASmoothEdge) {
    VoxelScene scene;
    scene.add_sphere({32, 32, 40}, 15);
    const Model model = scene.model();
    const Image mask = bake_ground(ShadowCasters(model, 1), sun({0, -1, 0}), plane_at(2), kSize, {.maps = 16});
    ASSERT_EQ(mask.width, kSize);
    ASSERT_EQ(mask.texels.size(), std::size_t{kSize} * kSize);
    double dark = 0;
    std::size_t between = 0;
    for (const std::uint8_t texel : mask.texels) {
        dark += 1 - texel / 255.0;
        between += texel > 0 && texel < 255 ? 1 : 0;
    }
    EXPECT_NEAR(dark / 4, std::numbers::pi * 15 * 15, 12);
    EXPECT_GT(between, 150U); // about a texel and a half along 188 texels
    EXPECT_EQ(at(mask, 32, 40), 0);
    EXPECT_EQ(at(mask, 40, 50), 0);
    EXPECT_EQ(at(mask, 32, 20), 255);
    EXPECT_EQ(at(mask, 50, 40), 255);
}

TEST(GroundShadow, APointLightMakesItLarger) {
    VoxelScene scene;
    scene.add_sphere({32, 32, 32}, 8);
    const Model model = scene.model();
    const ShadowCasters casters(model, 1);
    // The light is 64 above the plane and 32 above the centre: tangents at 14.5 degrees, shadow radius 16.5.
    const Image mask = bake_ground(casters, lamp({32, 64, 32}), plane_at(0), kSize, {.maps = 16});
    EXPECT_EQ(at(mask, 46, 32), 0);
    EXPECT_EQ(at(mask, 32, 18), 0);
    EXPECT_EQ(at(mask, 50, 32), 255);
    EXPECT_EQ(at(mask, 32, 14), 255);
    // A light within the model needs six views.
    const Image inside = bake_ground(casters, lamp({32, 32, 32}), plane_at(0), kSize, {.maps = 4});
    for (const std::uint8_t texel : inside.texels)
        ASSERT_EQ(texel, 0);
}

TEST(GroundShadow, NoLightLeaksBetweenABoxAndThePlaneItStandsOn) {
    VoxelScene scene;
    for (int a = 20; a < 44; ++a)
        for (int b = 4; b < 28; ++b) {
            scene.add(20, b, a, {-1, 0, 0});
            scene.add(43, b, a, {1, 0, 0});
            scene.add(a, b, 20, {0, 0, -1});
            scene.add(a, b, 43, {0, 0, 1});
        }
    scene.add_sheet(21, 43, 21, 43, 27);
    const Model model = scene.model();
    const Image mask = bake_ground(ShadowCasters(model, 1), sun({-1, -1, 0}), plane_at(4), kSize, {.maps = 16});
    for (double x = 0; x < 42; x += 0.5)
        for (double z = 23; z < 41; z += 0.5)
            ASSERT_EQ(at(mask, x, z), 0) << x << " " << z;
    EXPECT_EQ(at(mask, 46, 32), 255);
    EXPECT_EQ(at(mask, -8, 32), 255);
}

TEST(GroundShadow, FromBelowNothingIsLit) {
    VoxelScene scene;
    scene.add_sphere({32, 32, 32}, 8);
    const Model model = scene.model();
    for (const Light &light : {sun({0, 1, 0}), sun({1, 0, 0}), lamp({32, -5, 32})})
        for (const std::uint8_t texel :
             bake_ground(ShadowCasters(model, 1), light, plane_at(0), 16, {.maps = 1}).texels)
            ASSERT_EQ(texel, 0);
}

// The same for every compiler and machine.
TEST(GroundShadow, HasItsGoldenTexels) {
    VoxelScene scene;
    scene.add_sphere({30, 24, 34}, 13);
    const Model model = scene.model();
    EXPECT_EQ(
        hash64(bake_ground(ShadowCasters(model, 2), lamp({50, 70, 20}), plane_at(2), 64, {.maps = 9, .light_size = 0.2})
                   .texels),
        4698998315025356914U);
}

TEST(GroundShadow, BytesAreTheSameForAnyNumberOfThreads) {
    VoxelScene scene;
    scene.add_sphere({32, 32, 32}, 20);
    const Model model = scene.model();
    for (const Light &light : {sun({1, -1, 0.3}), lamp({50, 60, 40})}) {
        const Image one = bake_ground(ShadowCasters(model, 1), light, plane_at(3), 64, {.maps = 3, .threads = 1});
        EXPECT_EQ(bake_ground(ShadowCasters(model, 3), light, plane_at(3), 64, {.maps = 3, .threads = 4}), one);
    }
}

} // namespace
} // namespace pbm
