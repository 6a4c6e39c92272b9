#include "pbm_render/appearance/appearance.h"
#include "pbm_render/appearance/shade_table.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <array>

namespace pbm {
namespace {

const std::array<Material, 1> kMaterials{Material{.ka = 0.2F, .kd = 0.7F, .ks = 0.1F, .power = 4}};
const glm::vec3 kFront(0, 0, 1);

TEST(Phong, OfALightAlongTheNormalIsDiffusePlusSpecular) {
    const glm::vec3 light = phong(kMaterials[0], Light{}, kFront, kFront, kFront);
    EXPECT_FLOAT_EQ(light.r, 0.8F);
}

TEST(Phong, MirrorsTheLightInTheNormal) {
    // Light from 60 degrees above, eye at 60 degrees below: diffuse 0.5, the mirrored ray meets the eye.
    const glm::vec3 to_light(0, std::sqrt(0.75F), 0.5F), to_eye(0, -std::sqrt(0.75F), 0.5F);
    EXPECT_NEAR(phong(kMaterials[0], Light{}, kFront, to_light, to_eye).r, 0.7F * 0.5F + 0.1F, 1e-6F);
    // Eye in front: the mirrored ray is 60 degrees off, its cosine to the power 4 is 1/16.
    EXPECT_NEAR(phong(kMaterials[0], Light{}, kFront, to_light, kFront).r, 0.7F * 0.5F + 0.1F / 16, 1e-6F);
}

TEST(Phong, IsNothingBehindTheSurface) { EXPECT_EQ(phong(kMaterials[0], Light{}, kFront, -kFront, kFront).r, 0); }

TEST(ShadeTable, AddsAmbientAndEveryDirectionalLight) {
    const std::array<Light, 2> lights{Light{.intensity = {1, 0.5F, 0}}, Light{.direction = {-1, 0, 0}}};
    const ShadeTable table(kMaterials, lights, 0, kFront);
    const Float4 &front = table.unshadowed(0, quantise_normal(0, 0, 1));
    EXPECT_NEAR(front[0], 1.0F, 0.02F);
    EXPECT_NEAR(front[1], 0.6F, 0.02F);
    EXPECT_NEAR(front[2], 0.2F, 0.02F);
    EXPECT_NEAR(table.unshadowed(0, quantise_normal(0, 0, -1))[0], 0.2F, 0.02F);
}

TEST(ShadeTable, KeepsShadowedLightsApart) {
    const std::array<Light, 2> lights{Light{}, Light{.direction = {-1, 0, 0}}};
    const ShadeTable table(kMaterials, lights, 1, kFront);
    const std::size_t front = quantise_normal(0, 0, 1), right = quantise_normal(1, 0, 0);
    EXPECT_NEAR(table.unshadowed(0, front)[0], 0.2F, 0.02F);
    EXPECT_NEAR(table.shadowed(0, 0, front)[0], 0.8F, 0.02F);
    EXPECT_NEAR(table.unshadowed(0, right)[0], 0.2F + 0.7F, 0.02F);
}

TEST(DefaultLights, ShowTheFrontAndDoNotBurnOut) {
    for (const UpAxis up : {UpAxis::y, UpAxis::z, UpAxis::x}) {
        const glm::vec3 front = front_direction(up), above = up_direction(up);
        const glm::vec3 right = glm::cross(above, front);
        const ShadeTable table(kMaterials, default_lights(up), 0, front);
        const auto seen = [&](glm::vec3 n) { return table.unshadowed(0, quantise_normal(n.x, n.y, n.z))[0]; };
        EXPECT_GT(seen(above), seen(-above));
        EXPECT_GT(seen(-right), 0.3F);
        EXPECT_GT(seen(right), 0.25F);
        for (std::size_t n = 0; n < kNormalCount; ++n)
            EXPECT_LE(table.unshadowed(0, n)[0], 1.05F);
    }
}

TEST(ColourTable, ReturnsEveryByte) {
    const ColourTable table;
    for (int i = 0; i < 256; ++i) {
        const auto byte = static_cast<std::uint8_t>(i);
        const Rgba8 back = unpack_rgba(table.pack_srgb(table.linear(pack_rgba({byte, byte, byte, 255}))));
        EXPECT_NEAR(back[0], i, i < 20 ? 1 : 0);
        EXPECT_EQ(back[3], 255);
    }
}

TEST(ColourTable, ClampsBrightColours) {
    const ColourTable table;
    EXPECT_EQ(unpack_rgba(table.pack_srgb(Float4{7, 0.5F, 0, 0}))[0], 255);
    EXPECT_EQ(unpack_rgba(table.pack_srgb(Float4{7, 0.5F, 0, 0}))[1], 188); // half the light
    EXPECT_EQ(unpack_rgba(table.pack_srgb(Float4{7, 0.5F, 0, 0}))[2], 0);
}

} // namespace
} // namespace pbm
