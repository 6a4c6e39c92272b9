// Panorama and ground plane: pixels that miss the object, against values that follow from geometry.
#include "pbm_render/appearance/shade_table.h"
#include "pbm_render/camera/unit_grid.h"
#include "pbm_render/surroundings/panorama_sampler.h"
#include "pbm_render/surroundings/surroundings_view.h"
#include "pbm_render/surroundings/texel_levels.h"
#include "unit/render/surroundings_test_model.h"

#include <gtest/gtest.h>

namespace pbm {
namespace {

using namespace test;

const glm::dvec3 kMiddle(0, -1, -2); // centre of the ball
constexpr double kGround = -1.9;     // height of the ground plane

// Largest difference of a channel from colour_towards, over the pixels without object.
double worst_panorama(const Framebuffer &picture, const Camera &camera, UpAxis up) {
    const Projection projection(camera, picture.width, picture.height);
    double worst = 0;
    for (std::size_t i = 0; i < picture.pixels(); ++i) {
        if (picture.depth[i] != kEmpty)
            continue;
        const glm::dvec3 expected =
            colour_towards(panorama_axes(up) * glm::normalize(projection.ray(glm::dvec2(picture.centre(i)))));
        for (int c = 0; c < 3; ++c)
            worst =
                std::max(worst, std::abs(unpack_rgba(picture.colour[i])[static_cast<std::size_t>(c)] - expected[c]));
    }
    return worst;
}

RenderOptions only_panorama() {
    RenderOptions options;
    options.ground = false;
    return options;
}

TEST(Panorama, IsSeenWhereItLiesInEveryDirectionSeamAndPolesIncluded) {
    for (const UpAxis up : {UpAxis::y, UpAxis::z, UpAxis::x}) {
        Model model = ball_on_ground({});
        model.parameters.grid.up = up;
        for (const glm::dvec3 towards :
             {glm::dvec3(0, 0, -1), glm::dvec3(0, 0, 1), glm::dvec3(0, 1, 0), glm::dvec3(0, -1, 0), glm::dvec3(1, 0, 0),
              glm::dvec3(-1, 0, 0), glm::dvec3(0.1, 0.97, 0.02), glm::dvec3(-0.3, -0.5, 0.9)})
            for (const double angle : {0.3, 1.2, 2.2}) {
                const Camera camera = look_from(kMiddle + 50.0 * towards, kMiddle + 60.0 * towards, angle);
                EXPECT_LT(worst_panorama(reference_picture(model, camera, only_panorama(), 200, 150), camera, up), 1.6)
                    << towards.x << " " << towards.y << " " << towards.z << " angle " << angle;
            }
    }
}

TEST(Panorama, RowsThatTurnNearAPoleAreExact) {
    const Model model = ball_on_ground({});
    const Camera camera = look_from({0, 90, 0}, {0.3, 100, -0.2}, 0.6);
    EXPECT_LT(worst_panorama(reference_picture(model, camera, only_panorama(), 700, 500), camera, UpAxis::y), 1.6);
}

TEST(Panorama, IsAveragedInLinearLightWhereItIsFinerThanPixels) {
    Model model = ball_on_ground({});
    Image &panorama = model.images.panorama = coloured_panorama(1024);
    for (std::size_t i = 0; i < panorama.texels.size(); ++i) // alternating black and white columns
        panorama.texels[i] = i / 3 % 2 == 0 ? 0 : 255;
    const Framebuffer picture =
        reference_picture(model, look_from({0, 0, 50}, {0, 0, 60}, 1.5), only_panorama(), 64, 48);
    for (std::size_t i = 0; i < picture.pixels(); ++i)
        EXPECT_NEAR(picture.colour[i] & 255, 188, 1); // half of the linear light
}

TEST(Panorama, SamplesAlongDirectionsAsRowsAre) {
    const Model model = ball_on_ground({});
    const PanoramaSampler sampler(TiledImages::of(model.images).panorama, UpAxis::y);
    Random random(3);
    for (int i = 0; i < 2000; ++i) {
        const glm::dvec3 d = glm::normalize(glm::dvec3(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0 + 1e-9);
        const Float4 seen = sampler.sample(glm::vec3(7.0 * d), 0.001F);
        const glm::dvec3 expected = colour_towards(panorama_axes(UpAxis::y) * d);
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(linear_to_srgb(static_cast<std::uint32_t>(seen[c] * 65535)), expected[c], 1.6);
    }
}

TEST(Ground, LiesWhereTheRaysMeetItAndHidesWhatIsBehind) {
    const Model model = ball_on_ground({});
    const Camera camera = look_from({1, 0.5, 2.5}, {0, -1.7, -2});
    const Framebuffer picture = reference_picture(model, camera, {}, 320, 240);
    RenderOptions without;
    without.ground = false;
    const Framebuffer object = reference_picture(model, camera, without, 320, 240);
    const Projection projection(camera, 320, 240);
    std::size_t ground = 0, border = 0;
    for (std::size_t i = 0; i < picture.pixels(); ++i) {
        const glm::dvec3 ray = projection.ray(glm::dvec2(picture.centre(i)));
        const double depth = (kGround - camera.position.y) / ray.y;
        const glm::dvec3 hit = camera.position + depth * ray;
        const double inside = 1.5 - std::max(std::abs(hit.x), std::abs(hit.z + 2));
        if (depth > 0 && std::abs(inside) < 0.06) {
            ++border;
        } else if (depth > 0 && inside > 0 && depth < static_cast<double>(object.depth[i])) {
            ++ground;
            EXPECT_NEAR(picture.depth[i], depth, 1e-4 * depth);
            // ka + kd * 0.8, white
            EXPECT_NEAR(picture.colour[i] & 255, linear_to_srgb(65535 / 2), 1);
            EXPECT_EQ(picture.colour[i] >> 24, 255U);
        } else {
            EXPECT_EQ(picture.depth[i], object.depth[i]);
            EXPECT_EQ(picture.colour[i], object.colour[i]);
        }
    }
    EXPECT_GT(ground, 5000U);
    EXPECT_LT(border, 2500U);
}

TEST(Ground, IsNotSeenFromBelow) {
    const Model model = ball_on_ground({});
    const Camera camera = look_from({0, -6, 1}, kMiddle);
    RenderOptions without;
    without.ground = false;
    EXPECT_EQ(count_changes(reference_picture(model, camera, {}), reference_picture(model, camera, without)), 0U);
}

TEST(Ground, ItsBorderIsBlendedWithATransparentBackground) {
    Model model = ball_on_ground({});
    model.images = {};
    RenderOptions options;
    options.background = {10, 20, 30, 0};
    const Framebuffer picture = reference_picture(model, look_from({1, 3, 5}, {0, -1.9, -2}), options);
    std::size_t partly = 0;
    for (std::size_t i = 0; i < picture.pixels(); ++i) {
        const std::uint32_t pixel = picture.colour[i], alpha = pixel >> 24;
        if (alpha == 0) {
            EXPECT_EQ(pixel, pack_rgba(options.background));
            continue;
        }
        if (alpha == 255)
            continue;
        ++partly;
        EXPECT_NEAR(pixel & 255, linear_to_srgb(65535 / 2), 1); // straight alpha: the ground's own colour
    }
    EXPECT_GT(partly, 30U);
}

TEST(Ground, ItsBorderIsBlendedWithThePanoramaWhateverTheScratchHolds) {
    const Model model = ball_on_ground({});
    const auto surroundings = surroundings_of(model);
    const Appearance appearance(model.parameters);
    constexpr std::size_t kWidth = 640;
    const Projection projection(in_unit_grid(look_from({0.4, -0.9, 2.5}, {0, -1.9, -2}), model.parameters), kWidth,
                                480);
    const SurroundingsView view(surroundings.get(), appearance, projection, {});
    for (int y = 0; y < 480; ++y) {
        std::array<std::vector<std::uint32_t>, 2> colours;
        for (std::size_t i = 0; i < 2; ++i) {
            colours[i].resize(kWidth);
            std::vector<float> depths(kWidth, kEmpty);
            SurroundingsRow scratch;
            scratch.resize(kWidth);
            for (std::vector<float> *const floats : {&scratch.red, &scratch.green, &scratch.blue, &scratch.alpha})
                std::fill(floats->begin(), floats->end(), static_cast<float>(i));
            view.draw_row(y, {colours[i].data(), depths.data(), kWidth, 1}, scratch);
        }
        EXPECT_EQ(colours[0], colours[1]) << "row " << y;
    }
}

// Colour of the pixel that shows `place`.
std::uint32_t colour_at(const Framebuffer &picture, const Camera &camera, glm::dvec3 place) {
    const glm::dvec3 p = Projection(camera, picture.width, picture.height).point(place);
    return picture.colour[static_cast<std::size_t>(p.y / p.z) * static_cast<std::size_t>(picture.width) +
                          static_cast<std::size_t>(p.x / p.z)];
}

// From above: u runs along z, v along x. BVG.md 3.11
TEST(Ground, HasTheShadowWhereTheMaskHasIt) {
    AttributeSet set{.lights = 1, .shadow_bits = {}};
    set.shadow_bits[0].fill(8);
    Model model = ball_on_ground(set);
    Image lit = raster(64, 255);
    for (std::size_t row = 40; row < 56; ++row)             // v 0.625..0.875: x -1.5 + 3 v = 0.375..1.125
        for (std::size_t column = 8; column < 16; ++column) // u 0.125..0.25: z -3.5 + 3 u = -3.125..-2.75
            lit.texels[row * 64 + column] = 0;
    model.images.ground_lit = {lit};
    const Camera camera = look_from({0, 6, -2}, {0, -1.9, -2});
    const auto grey = [&](const Framebuffer &picture, double x, double z) {
        return static_cast<int>(colour_at(picture, camera, {x, kGround, z}) & 255);
    };
    const int light = linear_to_srgb(65535 / 2), dark = linear_to_srgb(6553);
    const Framebuffer picture = reference_picture(model, camera, {}, 400, 400);
    EXPECT_NEAR(grey(picture, 0.75, -2.94), dark, 1);
    EXPECT_NEAR(grey(picture, 0.9, -2.65), light, 1);
    EXPECT_NEAR(grey(picture, 0.3, -3.05), light, 1);
    EXPECT_NEAR(grey(picture, 1.3, -2.94), light, 1);
    EXPECT_NEAR(grey(picture, -0.75, -2.94), light, 1);
    RenderOptions unshadowed;
    unshadowed.shadows = false;
    EXPECT_NEAR(grey(reference_picture(model, camera, unshadowed, 400, 400), 0.75, -2.94), light, 1);
}

TEST(Ground, HasTheColoursOfItsTextureAndPalette) {
    Model model = ball_on_ground({});
    SolidTexture texture;
    for (std::size_t i = 0; i < 256; ++i)
        texture.palette[i] = {static_cast<std::uint8_t>(i), 255, static_cast<std::uint8_t>(255 - i)};
    model.parameters.ground->texture = texture;
    model.parameters.materials.back() = {.ka = 1, .kd = 0, .ks = 0, .power = 1};
    model.images.ground_texture = raster(32, 0);
    for (std::size_t i = 0; i < 32 * 32; ++i)
        model.images.ground_texture.texels[i] = static_cast<std::uint8_t>(8 * (i % 32)); // rises with u, that is z
    const Camera camera = look_from({0, 6, -2}, {0, -1.9, -2});
    const Framebuffer picture = reference_picture(model, camera, {}, 400, 400);
    for (const double z : {-3.2, -2.9, -1.0, -0.8}) {
        const Rgba8 seen = unpack_rgba(colour_at(picture, camera, {1.2, kGround, z}));
        const double value = 8 * ((z + 3.5) / 3 * 32 - 0.5);
        EXPECT_NEAR(seen[0], value, 2.5);
        EXPECT_EQ(seen[1], 255);
        EXPECT_NEAR(seen[2], 255 - value, 2.5);
    }
}

TEST(Ground, PositionalLightsAndHighlightsFollowPhong) {
    Model model = ball_on_ground({});
    Material &material = model.parameters.materials.back();
    material = {.ka = 0.05F, .kd = 0.4F, .ks = 0.5F, .power = 23, .colour = {255, 255, 255}};
    model.parameters.lights = {
        {.kind = LightKind::spot, .position = {1.8F, 1.9F, 1.7F}, .direction = {-0.36F, -0.8F, -0.48F}, .exponent = 9},
        {.kind = LightKind::point, .intensity = {0.3F, 0.3F, 0.3F}, .position = {0.2F, 0.8F, 0.4F}},
        {.intensity = {0.4F, 0.4F, 0.4F}, .direction = {0, -0.6F, -0.8F}}};
    const Camera camera = look_from({1, 0.5, 2.5}, {0.3, -1.9, -2});
    RenderOptions without;
    without.ground = false;
    for (const float exponent : {1.0F, 23.0F, 180.5F}) { // the last one bends too much to be interpolated
        material.power = model.parameters.lights[0].exponent = exponent;
        const Framebuffer picture = reference_picture(model, camera, {}, 320, 240);
        const Framebuffer object = reference_picture(model, camera, without, 320, 240);
        const Projection projection(camera, 320, 240);
        std::size_t ground = 0;
        for (std::size_t i = 0; i < picture.pixels(); ++i) {
            const glm::dvec3 ray = projection.ray(glm::dvec2(picture.centre(i)));
            const glm::dvec3 place = camera.position + (kGround - camera.position.y) / ray.y * ray;
            if (object.depth[i] != kEmpty || picture.depth[i] == kEmpty ||
                std::max(std::abs(place.x), std::abs(place.z + 2)) > 1.45)
                continue;
            float expected = material.ka;
            const glm::vec3 to_eye = glm::normalize(-ray);
            for (const Light &light : model.parameters.lights) {
                const glm::vec3 direction(light.direction[0], light.direction[1], light.direction[2]);
                glm::vec3 to_light = -direction;
                if (light.kind != LightKind::directional)
                    to_light = glm::normalize(glm::dvec3(light.position[0], light.position[1], light.position[2]) +
                                              glm::dvec3(-1, -2, -3) - place);
                float term = phong(material, light, {0, 1, 0}, to_light, to_eye).r;
                if (light.kind == LightKind::spot)
                    term *= std::pow(std::max(0.0F, -glm::dot(to_light, direction)), light.exponent);
                expected += term;
            }
            ++ground;
            EXPECT_NEAR(picture.colour[i] & 255,
                        linear_to_srgb(static_cast<std::uint32_t>(std::min(1.0F, expected) * 65535)), 1)
                << place.x << " " << place.z;
        }
        EXPECT_GT(ground, 5000U);
    }
}

TEST(TexelLevels, TellTheOnlyValueOfTexelsInCellsWithoutAnother) {
    ModelImages images;
    images.ground_lit = {raster(128, 255), raster(128, 7)};
    images.ground_lit[1].texels[20 * 128 + 100] = 9;
    const TexelLevels levels(TiledImages::of(images).ground_lit, 255);
    const auto value = [&](int level, int x, int y, int last_x, int last_y) {
        levels.require(level, x, y, last_x, last_y);
        return levels.only_value(level, x, y, last_x, last_y);
    };
    EXPECT_EQ(value(0, 0, 0, 95, 127), 0x7FFU); // the first raster in the lowest byte
    EXPECT_EQ(value(0, 104, 0, 127, 127), 0x7FFU);
    EXPECT_EQ(value(0, 90, 10, 95, 30), 0x7FFU);
    EXPECT_EQ(value(0, 96, 16, 103, 23), std::nullopt);
    EXPECT_EQ(value(0, 90, 10, 97, 17), std::nullopt);
    EXPECT_EQ(value(1, 0, 0, 47, 63), 0x7FFU);
    EXPECT_EQ(value(5, 0, 0, 3, 3), std::nullopt); // smaller than a cell
}

TEST(Ground, MirrorsThePanorama) {
    Model model = ball_on_ground({});
    model.parameters.materials.back().environment = 1;
    const Camera camera = look_from({1, 0.5, 2.5}, {0.8, -1.9, -1.2});
    const Framebuffer picture = reference_picture(model, camera, {}, 320, 240);
    const Projection projection(camera, 320, 240);
    const std::size_t at = picture.pixels() / 2 + 160;
    glm::dvec3 ray = glm::normalize(projection.ray(glm::dvec2(picture.centre(at))));
    ray.y = -ray.y;
    const glm::dvec3 expected = colour_towards(panorama_axes(UpAxis::y) * ray);
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(unpack_rgba(picture.colour[at])[static_cast<std::size_t>(c)], expected[c], 1.6);
}

} // namespace
} // namespace pbm
