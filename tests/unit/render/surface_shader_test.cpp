// Points shaded row by row with SIMD, against PointShader, which shades them one by one.
#include "pbm_render/shading/surface_shader.h"

#include "pbm_render/camera/unit_grid.h"
#include "pbm_render/shading/point_shader.h"
#include "unit/render/surroundings_test_model.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

namespace pbm {
namespace {

using namespace test;

constexpr int kRow = 300;

Model lit_model(float power) {
    AttributeSet set{.colour = ColourFormat::rgb888, .material = true, .lights = 2, .shadow_bits = {}};
    for (std::size_t l = 0; l < 2; ++l)
        set.shadow_bits[l].fill(8);
    Model model = ball_on_ground(set);
    model.parameters.materials = {{.ka = 0.1F, .kd = 0.5F, .ks = 0.4F, .power = power},
                                  {.ka = 0.3F, .kd = 0.3F, .ks = 0, .power = 2}};
    model.parameters.lights = {
        {.kind = LightKind::spot, .position = {3, 2.5F, 3}, .direction = {-0.6F, -0.48F, -0.64F}, .exponent = 2.5F},
        {.intensity = {0.4F, 0.5F, 0.6F}, .direction = {0.6F, 0, -0.8F}},
        {.kind = LightKind::point, .intensity = {0.5F, 0.4F, 0.3F}, .position = {-1, 2, 2}},
        {.intensity = {0.2F, 0.2F, 0.2F}, .direction = {0, -0.6F, -0.8F}}};
    return model;
}

// The stored normals first .. first + kRow - 1 in a row of pixels.
struct Row {
    std::vector<std::int32_t> x = std::vector<std::int32_t>(kRow + 16);
    std::vector<float> depth = std::vector<float>(kRow + 16, 1.0F);
    PointRow points{kRow};

    PointLook look(std::size_t i) const {
        return {.colour = static_cast<std::uint32_t>(0x10203 * (i % 85) + 0x40),
                .normal = static_cast<std::uint16_t>(points.normal[i] >> 16),
                .material = static_cast<std::uint16_t>(i % 2)};
    }
    static float lit(std::size_t i, std::size_t light) { return static_cast<float>((i + light) % 5) / 4; }

    Row(unsigned first, const ModelParameters &parameters) {
        points.count = kRow;
        for (std::size_t i = 0; i < kRow; ++i) {
            x[i] = static_cast<std::int32_t>(i);
            depth[i] = 2.0F + static_cast<float>(i % 7) / 10;
            const auto stored = static_cast<std::uint16_t>((first + i) & (kNormalIndexMask | kTwoSidedBit));
            points.normal[i] = normal_code(stored, normal_sums());
            points.colour[i] = look(i).colour;
            const Material &m = parameters.materials[i % 2];
            points.phong[i] = Float4{m.kd, m.ks, m.power, m.ka};
            for (std::size_t light = 0; light < 2; ++light)
                points.lit[light][i] = lit(i, light);
        }
    }
};

TEST(ShadePoints, AgreesWithPointShaderForEveryNormalAndKindOfLight) {
    for (const float power : {16.0F, 5.3F, 200.0F}) {
        const Model model = lit_model(power);
        const ModelParameters &parameters = model.parameters;
        const Appearance appearance(parameters);
        Camera camera = look_from({1, 0.5, 2.5}, {0, -1.7, -2});
        camera.backs = Backs::hide; // the fast renderer turns normals itself where it shows backs
        const Projection projection(in_unit_grid(camera, parameters), kRow, 200);
        const PointShader shader(parameters, appearance, projection, nullptr, {}, true);
        const std::vector<EyeLight> lights = lights_in_eye_space(appearance.lights, parameters.grid.edge(), projection);
        PointLighting lighting =
            make_point_lighting({static_cast<float>(projection.middle.x), static_cast<float>(projection.middle.y),
                                 static_cast<float>(1 / projection.focal)},
                                projection, lights);
        lighting.shadowed = shader.shadowed();
        ASSERT_EQ(lighting.shadowed, 2U);
        std::size_t others = 0;
        for (unsigned first = 0; first < 2 * kNormalCount; first += kRow) {
            Row row(first, parameters), other = row;
            const PixelPlaces places{row.x.data(), row.depth.data(), 50.5F};
            shade_points(lighting, places, row.points);
            for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
                Row same = other;
                hwy::SetSupportedTargetsForTest(target);
                shade_points(lighting, places, same.points);
                hwy::SetSupportedTargetsForTest(0);
                EXPECT_TRUE(std::equal(same.points.colour.begin(), same.points.colour.begin() + kRow,
                                       row.points.colour.begin()))
                    << hwy::TargetName(target);
            }
            for (std::size_t i = 0; i < kRow; ++i) {
                const glm::vec2 pixel(static_cast<float>(i) + 0.5F, 50.5F);
                const auto lit = [&](std::size_t light) { return Row::lit(i, light); };
                const Rgba8 seen = unpack_rgba(row.points.colour[i]);
                const Rgba8 expected = unpack_rgba(shader.shade<true>(other.look(i), pixel, lit, [&] {
                    return shader.positional(other.look(i), pixel, row.depth[i], lit);
                }));
                for (std::size_t channel = 0; channel < 4; ++channel)
                    others += std::abs(seen[channel] - expected[channel]) > 1;
            }
        }
        EXPECT_EQ(others, 0U) << "power " << power;
    }
}

} // namespace
} // namespace pbm
