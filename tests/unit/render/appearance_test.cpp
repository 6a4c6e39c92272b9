// Mirrors, solid texture and render options: both renderers, any number of threads.
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/reader.h"
#include "pbm_render/appearance/field_choice.h"
#include "pbm_render/fine/fine_renderer.h"
#include "unit/render/surroundings_test_model.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <hwy/targets.h>

#include <array>
#include <optional>
#include <set>

namespace pbm {
namespace {

using namespace test;

const glm::dvec3 kMiddle(0, -1, -2); // centre of the ball

AttributeSet rich() {
    AttributeSet set{.colour = ColourFormat::rgb888, .material = true, .texture = true, .lights = 1, .shadow_bits = {}};
    set.shadow_bits[0].fill(8);
    return set;
}

// A model with everything that a render option can switch off.
const Model &rich_model() {
    static const Model kModel = [] {
        Model model = ball_on_ground(rich());
        for (std::size_t i = 0; i < 256; ++i)
            model.parameters.texture[0].palette[i] = {200, static_cast<std::uint8_t>(i), 40};
        model.parameters.materials[1].environment = 0.5F;
        model.parameters.materials.back().environment = 0.3F;
        model.parameters.ground->texture = model.parameters.texture[0];
        model.images.ground_texture = raster(64, 90);
        model.images.ground_lit = {raster(64, 128)};
        return model;
    }();
    return kModel;
}

const Camera kCamera = look_from({1.5, 0.7, 2.5}, {0, -1.4, -2});

Framebuffer fast_picture(const Model &model, const RenderOptions &options, int threads = 1, int width = 160,
                         int height = 120) {
    const Bytes file = value_of(encode_model(model, {.storage = Storage::mapped, .chunk_points = 4096, .threads = 1}));
    const WholeLevel level(file, model.parameters.grid.depth);
    Framebuffer target(width, height);
    FastRenderer(model.parameters, 4096, threads, surroundings_of(model)).render(level.runs, kCamera, options, target);
    return target;
}

// What each pixel shows: compares the depths of two pictures, with and without the ground.
enum class Shown { object, ground, behind };
std::vector<Shown> shown(const Model &model) {
    RenderOptions bare;
    bare.ground = false;
    const Framebuffer object = reference_picture(model, kCamera, bare), all = reference_picture(model, kCamera, {});
    std::vector<Shown> result;
    for (std::size_t i = 0; i < all.pixels(); ++i)
        result.push_back(all.depth[i] == kEmpty            ? Shown::behind
                         : all.depth[i] == object.depth[i] ? Shown::object
                                                           : Shown::ground);
    return result;
}

// Counts the pixels of object, ground and background that `options` change.
std::array<std::size_t, 3> changes(const Model &model, const RenderOptions &options) {
    const Framebuffer with = reference_picture(model, kCamera, {}),
                      without = reference_picture(model, kCamera, options);
    const std::vector<Shown> what = shown(model);
    std::array<std::size_t, 3> counts{};
    for (std::size_t i = 0; i < with.pixels(); ++i)
        counts[static_cast<std::size_t>(what[i])] += static_cast<std::size_t>(with.colour[i] != without.colour[i]);
    return counts;
}

TEST(Switches, EachChangesWhatItShouldAndNothingElse) {
    std::array<std::size_t, 3> all{};
    for (const Shown one : shown(rich_model()))
        ++all[static_cast<std::size_t>(one)];
    ASSERT_GT(std::min({all[0], all[1], all[2]}), 1000U);

    RenderOptions options;
    options.panorama = false; // also visible through the border of the ground
    auto [object, ground, behind] = changes(rich_model(), options);
    EXPECT_EQ(object, 0U);
    EXPECT_LT(ground, 200U);
    EXPECT_EQ(behind, all[2]);

    options = {};
    options.ground = false;
    std::tie(object, ground, behind) = std::tuple_cat(changes(rich_model(), options));
    EXPECT_EQ(object, 0U);
    EXPECT_GT(ground, all[1] * 9 / 10);
    EXPECT_LT(behind, 200U); // pixels of its border

    options = {};
    options.reflections = false;
    std::tie(object, ground, behind) = std::tuple_cat(changes(rich_model(), options));
    EXPECT_GT(object, all[0] / 10); // one material of three
    EXPECT_LT(object, all[0] * 9 / 10);
    EXPECT_GT(ground, all[1] * 9 / 10);
    EXPECT_LT(behind, 200U);

    options = {};
    options.shadows = false;
    std::tie(object, ground, behind) = std::tuple_cat(changes(rich_model(), options));
    EXPECT_GT(object, 100U);
    EXPECT_GT(ground, all[1] * 9 / 10);
    EXPECT_LT(behind, 200U);

    options = {};
    options.texture = false;
    std::tie(object, ground, behind) = std::tuple_cat(changes(rich_model(), options));
    EXPECT_GT(object, all[0] * 9 / 10);
    EXPECT_GT(ground, all[1] * 9 / 10);
    EXPECT_LT(behind, 200U);

    options = {};
    options.point_colours = false; // the texture hides them
    EXPECT_EQ(changes(rich_model(), options), (std::array<std::size_t, 3>{}));
    Model coloured = rich_model();
    coloured.parameters.attributes.texture = false;
    coloured.parameters.texture.clear();
    std::tie(object, ground, behind) = std::tuple_cat(changes(coloured, options));
    EXPECT_GT(object, all[0] * 9 / 10);
    EXPECT_EQ(ground + behind, 0U);
}

TEST(Switches, DoNothingWhereTheFileHasNothing) {
    Model model = ball_on_ground({});
    model.images = {};
    model.parameters.ground.reset();
    RenderOptions options;
    options.panorama = options.ground = options.reflections = options.shadows = options.texture =
        options.point_colours = false;
    EXPECT_EQ(count_changes(reference_picture(model, kCamera, {}), reference_picture(model, kCamera, options)), 0U);
}

TEST(Mirror, ABallShowsThePanoramaThatItsNormalsMirror) {
    Model model = ball_on_ground({});
    model.parameters.ground.reset();
    model.parameters.materials.front().environment = 1;
    const Camera camera = look_from({3, 0, 8}, kMiddle, 0.3);
    const Framebuffer picture = reference_picture(model, camera, {}, 200, 200);
    const Projection projection(camera, 200, 200);
    double sum = 0, worst = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < picture.pixels(); ++i) {
        const glm::dvec3 ray = glm::normalize(projection.ray(glm::dvec2(picture.centre(i))));
        const glm::dvec3 from = camera.position - kMiddle;
        const double b = glm::dot(ray, from), hit = b * b - glm::dot(from, from) + 0.9 * 0.9;
        if (hit < 0.2) // near the outline normals vary much within a voxel
            continue;
        const glm::dvec3 normal = glm::normalize(from + (-b - std::sqrt(hit)) * ray);
        // Reflections use one view direction for all pixels, as if the eye were infinitely far away.
        const glm::dvec3 view = projection.axes.forward;
        const glm::dvec3 mirrored = view - 2 * glm::dot(normal, view) * normal;
        const glm::dvec3 expected = colour_towards(panorama_axes(UpAxis::y) * mirrored);
        for (int c = 0; c < 3; ++c) {
            const double error = std::abs(unpack_rgba(picture.colour[i])[static_cast<std::size_t>(c)] - expected[c]);
            sum += error;
            worst = std::max(worst, error);
            ++count;
        }
    }
    ASSERT_GT(count, 20000U);
    EXPECT_LT(sum / static_cast<double>(count), 4);
    EXPECT_LT(worst, 20);
}

TEST(Mirror, BlendsByTheMaterialsFactor) {
    std::array<int, 3> red{};
    for (const int step : {0, 1, 2}) {
        Model model = make_wall(4, 8);
        model.parameters.materials[0] = {.ka = 1, .kd = 0, .ks = 0, .power = 1, .colour = {0, 0, 0}};
        model.parameters.materials[0].environment = static_cast<float>(step) / 2;
        model.images.panorama = {.width = 4, .height = 2, .channels = 3, .texels = Bytes(24, 255)};
        const Framebuffer picture = reference_picture(model, camera_in_front({8, 8, 8}, 20), {}, 40, 40);
        red[static_cast<std::size_t>(step)] = static_cast<int>(picture.colour[20 * 40 + 20] & 255);
    }
    EXPECT_EQ(red, (std::array<int, 3>{0, linear_to_srgb(32768), 255}));
}

TEST(Surroundings, AreTheSameInBothRenderers) {
    const Framebuffer reference = reference_picture(rich_model(), kCamera, {}), fast = fast_picture(rich_model(), {});
    const std::vector<Shown> what = shown(rich_model());
    // Outlines of the object may differ by a pixel.
    const auto is_near_object = [&](int x, int y) {
        for (int v = std::max(y - 1, 0); v <= std::min(y + 1, fast.height - 1); ++v)
            for (int u = std::max(x - 1, 0); u <= std::min(x + 1, fast.width - 1); ++u)
                if (what[static_cast<std::size_t>(std::ptrdiff_t{v} * fast.width + u)] == Shown::object)
                    return true;
        return false;
    };
    std::size_t beside = 0, object = 0;
    double difference = 0;
    for (int y = 0; y < fast.height; ++y)
        for (int x = 0; x < fast.width; ++x) {
            const auto i = static_cast<std::size_t>(std::ptrdiff_t{y} * fast.width + x);
            if (!is_near_object(x, y)) {
                ++beside;
                EXPECT_EQ(reference.depth[i], fast.depth[i]) << x << ", " << y;
                EXPECT_EQ(reference.colour[i], fast.colour[i]) << x << ", " << y;
                continue;
            }
            ++object;
            for (std::size_t c = 0; c < 3; ++c)
                difference += std::abs(unpack_rgba(fast.colour[i])[c] - unpack_rgba(reference.colour[i])[c]);
        }
    EXPECT_GT(beside, fast.pixels() / 2);
    EXPECT_LT(difference / static_cast<double>(3 * object), 20);
}

TEST(Surroundings, AreTheSameForAnyThreadsAndSimdTargets) {
    Model model = rich_model();
    model.parameters.lights.push_back(
        {.kind = LightKind::spot, .position = {1.8F, 1.9F, 1.7F}, .direction = {-0.36F, -0.8F, -0.48F}, .exponent = 9});
    model.parameters.materials.back().ks = 0.3F;
    const Framebuffer one = fast_picture(model, {}, 1, 301, 203);
    for (const int threads : {2, 8}) {
        const Framebuffer picture = fast_picture(model, {}, threads, 301, 203);
        EXPECT_EQ(count_changes(one, picture), 0U) << threads;
        EXPECT_EQ(one.depth, picture.depth) << threads;
    }
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        EXPECT_EQ(count_changes(one, fast_picture(model, {}, 1, 301, 203)), 0U) << hwy::TargetName(target);
        hwy::SetSupportedTargetsForTest(0);
    }
}

TEST(Surroundings, PicturesWithoutDepthsShowThemToo) {
    const Bytes file = value_of(encode_model(rich_model(), {.storage = Storage::mapped, .threads = 1}));
    const WholeLevel level(file, rich_model().parameters.grid.depth);
    FastRenderer renderer(rich_model().parameters, 65536, 1, surroundings_of(rich_model()));
    Framebuffer with(160, 120), without(160, 120, false);
    renderer.render(level.runs, kCamera, {}, with);
    renderer.render(level.runs, kCamera, {}, without);
    EXPECT_EQ(count_changes(with, without), 0U);
}

TEST(Appearance, ChangesBetweenFrames) {
    const Model &model = rich_model();
    ReferenceRenderer renderer(model, surroundings_of(model));
    Framebuffer before(160, 120), after(160, 120), back(160, 120);
    renderer.render(kCamera, {}, before);
    Appearance appearance(model.parameters);
    appearance.palette.fill({0, 0, 255});
    appearance.ground_palette.fill({0, 0, 255});
    for (Material &material : appearance.materials)
        material.environment = 0;
    renderer.set_appearance(appearance);
    renderer.render(kCamera, {}, after);
    const std::vector<Shown> what = shown(model);
    for (std::size_t i = 0; i < after.pixels(); ++i)
        if (what[i] == Shown::object) {
            EXPECT_EQ(after.colour[i] & 0xFFFF, 0U) << i;
        }
    renderer.set_appearance(Appearance(model.parameters));
    renderer.render(kCamera, {}, back);
    EXPECT_EQ(count_changes(before, back), 0U);
}

// Directions of lights in right, up and towards the eye.
std::vector<glm::vec3> beside(const EyeAxes &eye, const Appearance &appearance) {
    std::vector<glm::vec3> directions;
    for (const Light &light : appearance.lights) {
        const glm::dvec3 d(light.direction[0], light.direction[1], light.direction[2]);
        directions.emplace_back(glm::dot(d, eye.right), glm::dot(d, eye.up), -glm::dot(d, eye.forward));
    }
    return directions;
}

TEST(LightsOfAFileWithoutLights, StandBesideEveryEye) {
    for (const UpAxis up : {UpAxis::y, UpAxis::z, UpAxis::x}) {
        ModelParameters parameters;
        parameters.grid.up = up;
        const Appearance appearance(parameters);
        const std::vector<glm::vec3> first = beside(front_axes(up), appearance);
        EXPECT_GT(first[0].x, 0); // the key light travels to the right and down, away from the eye
        EXPECT_LT(first[0].y, 0);
        EXPECT_LT(first[0].z, 0);
        for (const glm::dvec3 from : {glm::dvec3(1, 2, 3), glm::dvec3(-4, 0.1, 1), glm::dvec3(0.2, -5, -1)}) {
            const EyeAxes eye = eye_axes({.position = from, .focal_point = {}, .up = {1, 1, 0}});
            const std::vector<glm::vec3> seen = beside(eye, turn_lights(eye, parameters.grid, appearance));
            for (std::size_t light = 0; light < first.size(); ++light)
                EXPECT_LT(glm::length(seen[light] - first[light]), 1e-6F);
        }
    }
}

TEST(LightsOfAFile, StayUnlessTheyAreToFollowTheEye) {
    const EyeAxes behind = eye_axes({.position = {0, 0, -3}, .focal_point = {}, .up = {0, 1, 0}});
    ModelParameters parameters;
    parameters.grid = {.depth = 2, .origin = {-1, -2, -3}, .voxel_size = 0.5}; // edge 2
    parameters.lights = {{.kind = LightKind::spot, .position = {1.5F, 3, 7}, .direction = {0, 0.6F, -0.8F}}};
    Appearance appearance(parameters);
    EXPECT_EQ(turn_lights(behind, parameters.grid, appearance), appearance);
    appearance.lights_follow = LightsFollow::eye;
    const Appearance seen = turn_lights(behind, parameters.grid, appearance);
    const std::array<float, 3> place{0.5F, 3, -5}, direction{0, 0.6F, 0.8F}; // turned about the middle of the grid
    for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(seen.lights[0].position[axis], place[axis], 1e-5F);
        EXPECT_NEAR(seen.lights[0].direction[axis], direction[axis], 1e-6F);
    }
    EXPECT_FALSE(seen.shadows[0].of_file); // they were baked for the old place
}

// A ball shows the same picture to every eye, in every renderer; with lights that stay, one side is dark.
TEST(LightsOfAFileWithoutLights, LightABallAlikeFromEverySide) {
    const Model model = smooth_ball(6, {});
    const Bytes file = value_of(encode_model(model, {.storage = Storage::mapped, .chunk_points = 4096, .threads = 1}));
    const WholeLevel level(file, model.parameters.grid.depth);
    ReferenceRenderer reference(model, nullptr);
    FastRenderer fast(model.parameters, 4096, 1);
    FineRenderer fine(model.parameters, 4096, 1);
    const auto light = [&](LightsFollow follow, const glm::dvec3 &from) {
        Appearance appearance(model.parameters);
        appearance.lights_follow = follow;
        reference.set_appearance(appearance);
        fast.set_appearance(appearance);
        fine.set_appearance(appearance);
        const Camera camera = look_from(kMiddle + from, kMiddle);
        const RenderOptions options{.background = {0, 0, 0, 255}};
        std::array<Framebuffer, 3> pictures{Framebuffer(80, 80), Framebuffer(80, 80), Framebuffer(80, 80)};
        reference.render(camera, options, pictures[0]);
        fast.render(level.runs, camera, options, pictures[1]);
        fine.render(level.runs, camera, options, pictures[2], 1);
        std::array<double, 3> sums{};
        for (std::size_t i = 0; i < sums.size(); ++i)
            for (const std::uint32_t colour : pictures[i].colour)
                sums[i] += colour & 255U;
        return sums;
    };
    const auto front = light(LightsFollow::eye, {0, 0, 5});
    for (const glm::dvec3 from : {glm::dvec3(5, 0, 0), glm::dvec3(0, 0, -5), glm::dvec3(-3, 3, -2.6)}) {
        const auto seen = light(LightsFollow::eye, from);
        for (std::size_t i = 0; i < seen.size(); ++i)
            EXPECT_NEAR(seen[i] / front[i], 1, 0.02) << i;
    }
    const auto fixed = light(LightsFollow::model, {0, 0, -5});
    for (std::size_t i = 0; i < fixed.size(); ++i)
        EXPECT_LT(fixed[i], 0.8 * front[i]) << i;
}

// A ball whose points all have the colour (128, 90, 200).
Model coloured_ball() {
    Model model = smooth_ball(6, {.colour = ColourFormat::rgb888});
    for (Level &level : model.levels)
        for (std::size_t i = 0; i < level.points.size(); ++i)
            set_point_colour(level.points, i, ColourFormat::rgb888, {128, 90, 200});
    return model;
}

// Pictures of the reference renderer, the fast and the fine one, from the front. `appearance`: of the model if absent.
std::array<Framebuffer, 3> pictures_of(const Model &model, const RenderOptions &options,
                                       const std::optional<Appearance> &appearance = {}) {
    const auto around = std::make_shared<const Surroundings>(model.parameters, TiledImages::of(model.images));
    const Bytes file = value_of(encode_model(model, {.storage = Storage::mapped, .chunk_points = 4096, .threads = 1}));
    const WholeLevel level(file, model.parameters.grid.depth);
    ReferenceRenderer reference(model, around);
    FastRenderer fast(model.parameters, 4096, 1, around);
    FineRenderer fine(model.parameters, 4096, 1, around);
    const Appearance look = appearance.value_or(Appearance(model.parameters));
    reference.set_appearance(look);
    fast.set_appearance(look);
    fine.set_appearance(look);
    const Camera camera = look_from(kMiddle + glm::dvec3(0, 0, 5), kMiddle);
    std::array<Framebuffer, 3> pictures{Framebuffer(80, 80), Framebuffer(80, 80), Framebuffer(80, 80)};
    reference.render(camera, options, pictures[0]);
    fast.render(level.runs, camera, options, pictures[1]);
    fine.render(level.runs, camera, options, pictures[2], 4);
    return pictures;
}

Model ground_alone() {
    Model model = ball_on_ground({});
    model.images = {}; // no panorama
    return model;
}

TEST(Background, IsAGradientFromTopToBottomInEveryRenderer) {
    const RenderOptions options{.background = {200, 100, 0, 255}, .background_below = Rgba8{0, 100, 200, 255}};
    const Model bare = smooth_ball(6, {}), with_ground = ground_alone();
    for (const Model *const model : {&bare, &with_ground})
        for (const Framebuffer &picture : pictures_of(*model, options))
            for (const int y : {0, 5, 20}) {
                const Rgba8 seen = unpack_rgba(picture.colour[static_cast<std::size_t>(y) * 80]);
                const double down = (y + 0.5) / 80;
                EXPECT_NEAR(seen[0], 200 * (1 - down), 1);
                EXPECT_NEAR(seen[1], 100, 1);
                EXPECT_NEAR(seen[2], 200 * down, 1);
                EXPECT_EQ(seen[3], 255);
            }
}

TEST(ShadingOfPoints, UnlitIsTheirOwnColourExactly) {
    Model model = smooth_ball(6, {.colour = ColourFormat::rgb888});
    model.parameters.lights = default_lights(UpAxis::y);
    model.parameters.materials[0].environment = 0.5F;
    std::set<std::uint32_t> colours{pack_rgba({0, 0, 0, 0})};
    PointAttributes &points = model.levels.back().points;
    for (std::size_t i = 0; i < points.size(); ++i) { // every sRGB value, each in one channel at least
        const Rgb8 colour{static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i / 7),
                          static_cast<std::uint8_t>(i / 31)};
        set_point_colour(points, i, ColourFormat::rgb888, colour);
        colours.insert(pack_rgb(colour) | 0xFF000000U);
    }
    const auto pictures = pictures_of(model, {.background = {0, 0, 0, 0}, .shading = Shading::unlit});
    for (const std::size_t renderer : {0U, 1U}) {
        EXPECT_GT(std::set(pictures[renderer].colour.begin(), pictures[renderer].colour.end()).size(), 500U);
        for (const std::uint32_t colour : pictures[renderer].colour)
            ASSERT_TRUE(colours.contains(colour)) << renderer << ' ' << std::hex << colour;
    }
    for (const Framebuffer &picture :
         pictures_of(coloured_ball(), {.background = {0, 0, 0, 0}, .shading = Shading::unlit}))
        for (const std::uint32_t colour : picture.colour)
            ASSERT_TRUE(colour >> 24 != 255 || colour == pack_rgba({128, 90, 200, 255})) << std::hex << colour;
}

// A ball of colour (128, 90, 200) that reflects a white panorama by half, drawn by every renderer.
TEST(Mirror, TintsByTheMaterialsShare) {
    for (const int tint : {0, 128, 255})
        for (const bool has_colours : {false, true}) {
            Model model = has_colours ? coloured_ball() : smooth_ball(6, {});
            model.parameters.materials[0] = {.ka = 1,
                                             .kd = 0,
                                             .ks = 0,
                                             .colour = has_colours ? Rgb8{0, 0, 0} : Rgb8{128, 90, 200},
                                             .environment = 0.5F,
                                             .tint = static_cast<std::uint8_t>(tint)};
            model.images.panorama = {.width = 4, .height = 2, .channels = 3, .texels = Bytes(24, 255)};
            const auto pictures = pictures_of(model, {});
            for (std::size_t renderer = 0; renderer < pictures.size(); ++renderer)
                for (std::size_t c = 0; c < 3; ++c) {
                    const double own = linear_table()[Rgb8{128, 90, 200}[c]] / 65535.0, share = tint / 255.0;
                    const double expected = own + 0.5 * ((1 - share + share * own) - own);
                    EXPECT_NEAR(unpack_rgba(pictures[renderer].colour[40 * 80 + 40])[c],
                                linear_to_srgb(static_cast<std::uint32_t>(expected * 65535 + 0.5)), 1)
                        << tint << ' ' << has_colours << ' ' << renderer << ' ' << c;
                }
        }
}

TEST(ShadingOfPoints, ColoursKeepTheirBrightnessWhereTheyFaceTheEye) {
    for (const Framebuffer &picture : pictures_of(coloured_ball(), {})) {
        const Rgba8 middle = unpack_rgba(picture.colour[40 * 80 + 40]);
        EXPECT_NEAR(middle[0], 128, 4);
        EXPECT_NEAR(middle[1], 90, 4);
        EXPECT_NEAR(middle[2], 200, 4);
    }
}

TEST(ShadingOfPoints, ASingleColourIsFoundInTheCoarseLevels) {
    const auto has_one = [](const Model &model) {
        const Bytes file = value_of(encode_model(model, {.threads = 1}));
        Reader reader = value_of(Reader::open(file));
        return value_of(has_one_colour(reader));
    };
    Model model = coloured_ball();
    EXPECT_TRUE(has_one(model));
    EXPECT_FALSE(has_one(smooth_ball(6, {})));
    set_point_colour(model.levels.back().points, 0, ColourFormat::rgb888, {255, 0, 0});
    average_levels(model, 1);
    EXPECT_FALSE(has_one(model));
}

TEST(ShadingOfPoints, WhatHasNoColoursOrIsLitOnPurposeIsLit) {
    const auto is_softened = [](const Model &model, RenderOptions options, const std::optional<Appearance> &look = {}) {
        const auto usual = pictures_of(model, options, look);
        options.shading = Shading::lit;
        const auto lit = pictures_of(model, options, look);
        EXPECT_EQ(usual[0].colour == lit[0].colour, usual[1].colour == lit[1].colour);
        EXPECT_EQ(usual[0].colour == lit[0].colour, usual[2].colour == lit[2].colour);
        return usual[0].colour != lit[0].colour;
    };
    const Model model = coloured_ball();
    EXPECT_TRUE(is_softened(model, {}));
    EXPECT_FALSE(is_softened(smooth_ball(6, {}), {}));
    EXPECT_FALSE(is_softened(model, {.point_colours = false}));
    Model with_light = model;
    with_light.parameters.lights = {{.direction = {0, 0, -1}}};
    EXPECT_FALSE(is_softened(with_light, {}));
    Appearance moved(model.parameters), shiny(model.parameters), fixed(model.parameters), plain(model.parameters);
    plain.has_one_colour = true;
    moved.lights[0].intensity = {1, 1, 1};
    shiny.materials[0].ks = 0.9F;
    fixed.lights_follow = LightsFollow::model;
    for (const Appearance &look : {moved, shiny, fixed, plain})
        EXPECT_FALSE(is_softened(model, {}, look));
    Model lamp = model; // three quarters of its colour are light of its own
    lamp.parameters.materials[0].ka = 0.75F + 0.25F * 0.2F;
    lamp.parameters.materials[0].kd = 0.25F * 0.7F;
    const auto darkest = [](const Framebuffer &picture) {
        std::uint8_t least = 255;
        for (std::size_t at = 0; at < picture.pixels(); ++at)
            if (picture.depth[at] < std::numeric_limits<float>::infinity())
                least = std::min(least, unpack_rgba(picture.colour[at])[0]);
        return linear_table()[least];
    };
    for (const Framebuffer &picture : pictures_of(lamp, {.background = {255, 255, 255, 255}})) {
        EXPECT_NEAR(unpack_rgba(picture.colour[40 * 80 + 40])[0], 128, 2);
        EXPECT_GT(darkest(picture), linear_table()[128] * 3 / 4);
    }
    EXPECT_LT(darkest(pictures_of(model, {})[0]), linear_table()[128] * 3 / 4);
    Model unlit = model; // as KHR_materials_unlit
    unlit.parameters.materials[0] = {.ka = 1, .kd = 0, .ks = 0};
    for (const Framebuffer &picture : pictures_of(unlit, {}))
        EXPECT_EQ(picture.colour[40 * 80 + 40], pack_rgba({128, 90, 200, 255}));
}

TEST(Surroundings, ADamagedTileIsNamedAndShownFromACoarserLevel) {
    const Model &model = rich_model();
    Bytes file = value_of(encode_model(model, {.threads = 1}));
    const Reader whole = value_of(Reader::open(file));
    const SectionEntry &section = *whole.section(SectionType::panorama);
    file[section.offset + section.stored_bytes - 100] ^= 1; // in the last tile of the finest level: lower right
    const Reader reader = value_of(Reader::open(file));
    const auto surroundings = std::make_shared<const Surroundings>(reader.parameters(), value_of(read_images(reader)));
    ReferenceRenderer renderer(model, surroundings);
    const Camera camera = look_from({3, -5, 5}, {3.5, -8, 8}, 1.2); // looks backwards and down
    Framebuffer damaged(200, 150);
    RenderOptions options;
    options.ground = options.reflections = false;
    renderer.render(camera, options, damaged);
    const Framebuffer good = reference_picture(model, camera, options, 200, 150);
    EXPECT_EQ(surroundings->take_errors().size(), 1U);
    EXPECT_TRUE(surroundings->take_errors().empty());
    EXPECT_GT(count_changes(good, damaged), 100U);
    for (std::size_t i = 0; i < good.pixels(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(unpack_rgba(damaged.colour[i])[c], unpack_rgba(good.colour[i])[c], 6);
}

} // namespace
} // namespace pbm
