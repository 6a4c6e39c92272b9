// Points in the colours of a field: colour maps, and pictures of streamed and of whole models. BVG.md 17
#include "pbm_format/model/las_classes.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/writer.h"
#include "pbm_render/appearance/field_choice.h"
#include "pbm_render/appearance/field_colours.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/shading/unasked_look.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <set>

namespace pbm {
namespace {

using namespace test;

const Field kHeights{.name = "height", .unit = "m", .offset = 10, .scale = 0.5, .bytes = 1};
const Field kLabels{.name = "classification", .unit = "", .bytes = 1, .average = FieldAverage::majority};

std::vector<std::uint32_t> picture_of(StreamedModel &shown, const ModelParameters &as) {
    const Camera camera = default_camera(*shown.bounds(), UpAxis::y, 160, 120);
    Framebuffer target(160, 120);
    const auto detail = shown.load({.camera = camera, .width = 160, .height = 120});
    EXPECT_TRUE(detail);
    FastRenderer renderer(as, 512, 1);
    renderer.render(detail->runs, camera, {}, target);
    return {target.colour.begin(), target.colour.end()};
}

TEST(FieldColours, TheMapRunsOverTheRange) {
    const FieldColours colours = field_colours(0, kHeights, {.range = {{20, 30}}, .map = ColourMap::grey}, {});
    EXPECT_EQ(colours.indices.size(), 256U);
    EXPECT_EQ(colours.indices[0], 0);
    EXPECT_EQ(colours.indices[1], 1);    // 10: below the range
    EXPECT_EQ(colours.indices[21], 1);   // 20
    EXPECT_EQ(colours.indices[31], 128); // 25
    EXPECT_EQ(colours.indices[41], 255); // 30
    EXPECT_EQ(colours.indices[255], 255);
    EXPECT_EQ(colours.palette[1], (Rgb8{0, 0, 0}));
    EXPECT_EQ(colours.palette[255], (Rgb8{255, 255, 255}));
}

// Published values of viridis at 0, 1/2 and 1; the polynomial is within 4 of them.
TEST(FieldColours, ViridisIsTheKnownOne) {
    const FieldColours colours = field_colours(0, kHeights, {}, {});
    const auto near = [&](std::size_t index, Rgb8 expected) {
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(colours.palette[index][c], expected[c], 4) << index;
    };
    near(1, {68, 1, 84});
    near(128, {33, 145, 140});
    near(255, {253, 231, 37});
}

TEST(FieldColours, TheRangeLeavesOutTheFarthestValues) {
    Bytes sample(1000, 50);
    for (std::size_t i = 0; i < 500; ++i)
        sample[i] = 100;
    sample[0] = 255; // fewer than a hundredth
    sample[1] = 0;   // no value
    const FieldColours colours = field_colours(0, kHeights, {}, sample);
    EXPECT_EQ(colours.least, kHeights.value(50));
    EXPECT_EQ(colours.most, kHeights.value(100));
    const FieldColours even = field_colours(0, kHeights, {}, Bytes(10, 7));
    EXPECT_EQ(even.least, kHeights.value(7));
    EXPECT_EQ(even.most, even.least);
    EXPECT_EQ(even.indices[6], 1);
    EXPECT_EQ(even.indices[7], 128);
    EXPECT_EQ(even.indices[8], 255);
    Bytes odd(1000, 50);
    odd.back() = 90; // nearly all are equal: the range is that of all
    EXPECT_EQ(field_colours(0, kHeights, {}, odd).most, kHeights.value(90));
    const FieldColours none = field_colours(0, kHeights, {}, Bytes(10, 0));
    EXPECT_LT(none.least, none.most);
}

TEST(FieldColours, LabelsHaveColoursOfTheirOwn) {
    const FieldColours colours = field_colours(0, kLabels, {}, Bytes{3, 0, 7, 3});
    EXPECT_EQ(colours.map, ColourMap::classes);
    EXPECT_EQ(colours.labels, (std::vector<std::uint32_t>{3, 7}));
    EXPECT_EQ(class_name(2), "ground"); // stored 3
    std::set<Rgb8> all;
    for (std::uint32_t label = 0; label < 40; ++label)
        all.insert(colours.palette[colours.indices[label + 1]]);
    EXPECT_EQ(all.size(), 40U);
    const Field below{.name = "label", .unit = "", .offset = -3, .average = FieldAverage::majority};
    const FieldColours negative = field_colours(0, below, {}, Bytes{1, 2, 3, 4});
    EXPECT_EQ(std::set<std::uint8_t>(negative.indices.begin() + 1, negative.indices.begin() + 5).size(), 4U);
    EXPECT_EQ(field_colours(0, kLabels, {.range = {{0, 9}}, .map = {}}, {}).map, ColourMap::viridis);
}

TEST(FieldColours, IntensitiesHaveAMiddleGreyMedian) {
    const Field intensity{.name = "scalar_Intensity", .unit = "", .bytes = 2};
    Bytes sample(2000);
    for (std::size_t i = 0; i < 1000; ++i) // most echoes are weak
        set_stored_value(sample, i, 2, static_cast<std::uint32_t>(1 + i * i / 40));
    const FieldColours colours = field_colours(0, intensity, {}, sample);
    EXPECT_EQ(colours.map, ColourMap::grey);
    EXPECT_EQ(colours.least, 20 * 20 / 40);
    EXPECT_EQ(colours.most, 979 * 979 / 40);
    EXPECT_EQ(colours.palette[colours.indices[1 + 500 * 500 / 40]], (Rgb8{128, 128, 128}));
    EXPECT_EQ(colours.indices[1], 1);
    EXPECT_EQ(colours.indices[65535], 255);
    EXPECT_EQ(field_colours(0, intensity, {.range = {{0, 9}}, .map = {}}, sample).gamma, 1);
    EXPECT_EQ(field_colours(0, intensity, {.range = {}, .map = ColourMap::viridis}, sample).gamma, 1);
    EXPECT_EQ(field_colours(0, intensity, {}, Bytes(20, 1)).gamma, 1); // all are equal
    EXPECT_EQ(field_colours(0, kHeights, {}, Bytes{1, 2, 3, 9}).gamma, 1);
}

TEST(FieldColours, HeightsAreThoseOfVoxelCentres) {
    const Grid grid{.depth = 6, .origin = {-10, 100, 5}, .voxel_size = 0.5, .unit = Unit::metre};
    const Field height = height_field(grid, 1);
    for (const int level : {0, 1, 6})
        for (const std::uint32_t y : {0U, (1U << level) - 1})
            EXPECT_NEAR(height.value(stored_height(y, level)), 100 + (y + 0.5) * grid.voxel_size_at(level),
                        grid.edge() / 65535);
    EXPECT_EQ(stored_height(65535, 16), 65535U);
    EXPECT_EQ(stored_height(0, 16), 1U);
    EXPECT_EQ(height.unit, "m");
}

// A picture of a file by heights or normals is that of a file that stores these colours; streamed chunks and whole
// levels find them in different ways.
TEST(FieldColours, HeightsAndNormalsAreThoseOfStoredColours) {
    const Model model = sphere_model(6, {.colour = ColourFormat::rgb565, .texture = true});
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes file = value_of(encode_model(model, {.storage = storage, .chunk_points = 512}));
        for (const char *name : {"height", "normal", "plain"}) {
            Reader reader = value_of(Reader::open(file));
            const FieldColours colours = value_of(choose_field_colours(reader, name, {}, UpAxis::x));
            Model coloured = model;
            colour_by_field(coloured, colours);
            if (coloured.parameters.attributes.colour == ColourFormat::none)
                for (Level &level : coloured.levels)
                    level.points.colours.clear();
            if (!coloured.parameters.attributes.texture)
                for (Level &level : coloured.levels)
                    level.points.textures.clear();
            if (std::string_view(name) == "height") {
                const std::vector<std::uint8_t> &heights = coloured.levels.back().points.textures;
                EXPECT_GT(std::set<std::uint8_t>(heights.begin(), heights.end()).size(), 32U);
            }
            const Bytes other = value_of(encode_model(coloured, {.storage = storage, .chunk_points = 512}));
            StreamedModel streamed(value_of(Reader::open(file)), {.threads = 1, .field = colours});
            StreamedModel expected(value_of(Reader::open(other)), {.threads = 1});
            EXPECT_EQ(picture_of(streamed, with_field_colours(streamed.reader().parameters(), colours)),
                      picture_of(expected, expected.reader().parameters()))
                << name;
        }
    }
}

// A picture of a file by a field is that of a file whose texture values are the field's colours.
TEST(FieldColours, AStreamedModelIsDrawnLikeOneWithThatTexture) {
    Model model = sphere_model(6, {.colour = ColourFormat::rgb888});
    add_fields(model);
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes file = value_of(encode_model(model, {.storage = storage, .chunk_points = 512}));
        for (std::size_t f = 0; f < model.parameters.fields.size(); ++f) {
            const FieldColours colours = field_colours(f, model.parameters.fields[f], {}, model.levels[4].fields[f]);
            StreamedModel streamed(value_of(Reader::open(file)), {.threads = 1, .field = colours});
            const ModelParameters parameters = with_field_colours(streamed.reader().parameters(), colours);

            Model textured = model;
            colour_by_field(textured, colours);
            textured.parameters.fields.clear();
            const Bytes other = value_of(encode_model(textured, {.storage = storage, .chunk_points = 512}));
            StreamedModel expected(value_of(Reader::open(other)), {.threads = 1});

            EXPECT_EQ(picture_of(streamed, parameters), picture_of(expected, expected.reader().parameters())) << f;
            EXPECT_GT(streamed.statistics().memory, 0U);
        }
    }
}

TEST(FieldColours, FieldsWinOverWhatEveryModelHas) {
    ModelParameters parameters;
    EXPECT_EQ(colour_names(parameters), (std::vector<std::string>{"height", "normal", "plain"}));
    EXPECT_TRUE(can_colour_by(parameters, "Height"));
    EXPECT_FALSE(can_colour_by(parameters, "class"));
    parameters.fields = {Field{"HEIGHT", ""}, Field{"classification", ""}, Field{"return_number", ""}};
    EXPECT_EQ(colour_names(parameters),
              (std::vector<std::string>{"HEIGHT", "classification", "return_number", "normal", "plain"}));
    EXPECT_TRUE(can_colour_by(parameters, "class"));
    EXPECT_TRUE(can_colour_by(parameters, "return"));
    EXPECT_EQ(field_to_keep("class"), "classification");
    EXPECT_EQ(field_to_keep("Intensity"), "Intensity");
    EXPECT_EQ(field_to_keep("plain"), "");
}

TEST(UnaskedLook, IsThatOfUncolouredClouds) {
    Model model = sphere_model(4, {});
    const auto look_of = [&](const char *metadata) {
        model.metadata = metadata;
        const Bytes file = value_of(encode_model(model, {}));
        return unasked_look(value_of(Reader::open(file)));
    };
    EXPECT_EQ(look_of(R"({"uncoloured_cloud":true})").colour_by, "height");
    EXPECT_EQ(look_of(R"({"uncoloured_cloud":true})").depth_cue, DepthCue::eye_dome);
    EXPECT_FALSE(look_of(R"({"uncoloured_cloud":true,"crs":"EPSG:1"})").from_above);
    model.parameters.grid.up = UpAxis::z;
    EXPECT_FALSE(look_of(R"({"uncoloured_cloud":true})").from_above);
    EXPECT_TRUE(look_of(R"({"uncoloured_cloud":true,"crs":"EPSG:1"})").from_above);
    EXPECT_FALSE(look_of(R"({"crs":"EPSG:1"})").from_above);
    model.metadata = R"({"uncoloured_cloud":true,"crs":"EPSG:1"})";
    const Bytes bytes = value_of(encode_model(model, {}));
    StreamedModel on_map(value_of(Reader::open(bytes)), {.threads = 1});
    const Camera camera = default_camera(value_of(on_map.bounds()), UpAxis::z, 160, 120);
    const glm::dvec3 forward = camera.focal_point - camera.position;
    EXPECT_NEAR(-forward.z / glm::length(forward), 0.5, 1e-9); // from 30 degrees above,
    EXPECT_GT(forward.y, 0);                                   // and north is behind the model
    for (const char *other : {"{}", R"({"uncoloured_cloud":false})", R"({"name":"\"uncoloured_cloud\":true"})"})
        EXPECT_EQ(look_of(other).colour_by, "") << other;
    model = sphere_model(4, {.colour = ColourFormat::rgb565});
    EXPECT_EQ(look_of(R"({"uncoloured_cloud":true})").depth_cue, DepthCue::none);
}

TEST(FieldColours, ADamagedFieldIsReported) {
    Model model = sphere_model(6, {});
    add_fields(model);
    Bytes file = value_of(encode_model(model, {.chunk_points = 512}));
    const Reader reader = value_of(Reader::open(file));
    file[reader.section(SectionType::field_values, 6)->offset] ^= 1;
    const FieldColours colours = field_colours(0, model.parameters.fields[0], {}, {});
    StreamedModel streamed(value_of(Reader::open(file)), {.threads = 1, .field = colours});
    const auto bounds = streamed.bounds(); // loads the six coarsest levels
    ASSERT_FALSE(bounds);
    EXPECT_EQ(bounds.error().rule, "17.5.1");
}

} // namespace
} // namespace pbm
