// Points of hidden classes: no renderer draws them, at no level, packed and mapped.
#include "pbm_format/model/octree.h"
#include "pbm_format/writing/writer.h"
#include "pbm_render/appearance/field_choice.h"
#include "pbm_render/appearance/legend.h"
#include "pbm_render/bricks/round_points.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/tables/table_renderer.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <type_traits>

namespace pbm {
namespace {

using namespace test;

constexpr int kEdge = 128;
constexpr std::uint32_t kGround = 2, kNoise = 7; // classes of the lower and the upper half, and of none
const Field kClass{.name = "Classification", .unit = "", .bytes = 1, .average = FieldAverage::majority};

// A sphere whose points are unlit: ground is blue, noise is red.
Model halves(bool round, bool with_others = false) {
    Model model = sphere_model(6, {.material = true});
    if (with_others)
        add_fields(model);
    model.parameters.materials.assign(3, {.ka = 1, .kd = 0, .ks = 0});
    if (round)
        model.parameters.materials[1].shape = PointShape::round;
    model.parameters.fields.push_back(kClass);
    Level &finest = model.levels.back();
    finest.fields.emplace_back(finest.points.size());
    std::vector<MortonCode> codes{0};
    for (std::size_t l = 1; l < model.levels.size(); ++l)
        codes = value_of(expand_level(codes, model.levels[l].masks, model.levels[l].points.size()));
    for (std::size_t i = 0; i < codes.size(); ++i)
        finest.fields.back()[i] = static_cast<std::uint8_t>(1 + (morton_decode(codes[i])[1] < 32 ? kGround : kNoise));
    average_fields(model, 1);
    model.metadata = "{}";
    return model;
}

FieldColours blue_and_red(const Model &model) {
    FieldColours colours = field_colours(0, kClass, {}, model.levels.back().fields[0]);
    colours.palette[colours.indices[1 + kGround]] = {0, 0, 255};
    colours.palette[colours.indices[1 + kNoise]] = {255, 0, 0};
    return colours;
}

struct Seen {
    bool red = false, blue = false;
    bool operator==(const Seen &) const = default;
};
Seen colours_in(const Framebuffer &target) {
    Seen seen;
    for (const std::uint32_t pixel : target.colour) {
        const Rgba8 colour = unpack_rgba(pixel);
        seen.red |= colour[0] > 0 && colour[3] == 255;
        seen.blue |= colour[2] > 0 && colour[3] == 255;
    }
    return seen;
}

const RenderOptions kOnBlack{.background = {0, 0, 0, 255}};

template <class Renderer>
Seen seen_streamed(const Model &model, const FieldColours &colours, const std::optional<HiddenClasses> &hidden,
                   Storage storage, int level, const Camera &camera) {
    const Bytes file = value_of(encode_model(model, {.storage = storage, .chunk_points = 512}));
    StreamedModel streamed(
        value_of(Reader::open(file)),
        {.threads = 1, .field = colours, .hidden = hidden ? std::make_shared<const HiddenClasses>(*hidden) : nullptr});
    const ModelParameters parameters = with_field_colours(streamed.reader().parameters(), colours);
    const Detail detail =
        value_of(streamed.load({.camera = camera, .width = kEdge, .height = kEdge, .max_error = 0.1, .finest = level}));
    Framebuffer target(kEdge, kEdge);
    Renderer(parameters, 512, 1).render(detail.runs, camera, kOnBlack, target);
    return colours_in(target);
}

template <class Renderer> Seen seen_whole(Model model, const HiddenClasses &hidden, int level, const Camera &camera) {
    const FieldColours colours = blue_and_red(model);
    colour_by_field(model, colours);
    hide_points(model, hidden);
    Renderer renderer(model);
    Appearance appearance(model.parameters);
    appearance.palette = colours.palette;
    renderer.set_appearance(appearance);
    Framebuffer target(kEdge, kEdge, true);
    if constexpr (std::is_same_v<Renderer, TableRenderer>)
        renderer.render(camera, kOnBlack, target, {.level = level});
    else
        renderer.render(camera, kOnBlack, target, level);
    return colours_in(target);
}

TEST(HiddenClasses, AreNotDrawnByAnyRendererAtAnyLevel) {
    for (const bool round : {false, true}) {
        const Model model = halves(round);
        const FieldColours colours = blue_and_red(model);
        const Camera whole = default_camera(model, kEdge, kEdge);
        Camera inside = whole; // some points lie around the eye
        inside.position = whole.focal_point + 0.05 * (whole.position - whole.focal_point);
        const HiddenClasses noise = value_of(hidden_classes(model.parameters, {.dropped{1U << kNoise}, .shown{}})),
                            all_but_noise =
                                value_of(hidden_classes(model.parameters, {.dropped{}, .shown{1U << kNoise}}));
        const Seen blue{.blue = true}, red{.red = true};
        for (const Camera &camera : {whole, inside})
            for (int level = 2; level <= 6; ++level) {
                for (const Storage storage : {Storage::packed, Storage::mapped}) {
                    const auto fast = [&](const auto &hidden) {
                        return seen_streamed<FastRenderer>(model, colours, hidden, storage, level, camera);
                    };
                    EXPECT_EQ(fast(std::optional<HiddenClasses>()), (Seen{true, true})) << level;
                    EXPECT_EQ(fast(std::optional(noise)), blue) << level;
                    EXPECT_EQ(fast(std::optional(all_but_noise)), red) << level;
                    EXPECT_EQ((seen_streamed<FineRenderer>(model, colours, noise, storage, level, camera)), blue);
                }
                EXPECT_EQ((seen_whole<ReferenceRenderer>(model, noise, level, camera)), blue) << level;
                EXPECT_EQ((seen_whole<TableRenderer>(model, noise, level, camera)), blue)
                    << level << (camera == whole ? " from outside" : " from inside");
            }
    }
}

// The colours of another field, and the camera, which frames what is drawn.
TEST(HiddenClasses, GoWithTheColoursOfAnotherField) {
    const Model model = halves(false, true);
    const Bytes file = value_of(encode_model(model, {.chunk_points = 512}));
    const HiddenClasses hidden = value_of(hidden_classes(model.parameters, {.dropped{1U << kNoise}, .shown{}}));
    EXPECT_EQ(hidden.field, 3U); // "classification" wins over "class"
    StreamedModel all(value_of(Reader::open(file)), {.threads = 1});
    const FieldColours colours = field_colours(1, model.parameters.fields[1], {}, {});
    StreamedModel some(value_of(Reader::open(file)),
                       {.threads = 1, .field = colours, .hidden = std::make_shared<const HiddenClasses>(hidden)});
    const auto top = [](StreamedModel &shown) { // from -2 to 0
        double highest = -2;
        for (const glm::dvec3 &corner : value_of(shown.bounds()).corners)
            highest = std::max(highest, corner.y);
        return highest;
    };
    EXPECT_GT(top(all), -0.2);
    EXPECT_LT(top(some), -0.8);
}

TEST(HiddenClasses, FollowNamesAndValues) {
    ModelParameters parameters;
    EXPECT_FALSE(has_classes(parameters));
    EXPECT_EQ(hidden_classes(parameters, {}).error().code, ErrorCode::usage);
    parameters.fields = {{.name = "class", .unit = "", .offset = -1, .bytes = 2}};
    const HiddenClasses dropped = value_of(hidden_classes(parameters, {.dropped{0b100}, .shown{}}));
    EXPECT_EQ(dropped.hides.size(), 65536U);
    EXPECT_EQ(dropped.hides[0], 0); // no class
    EXPECT_EQ(dropped.hides[4], 1); // 2
    EXPECT_EQ(std::count(dropped.hides.begin(), dropped.hides.end(), 1), 1);
    const HiddenClasses shown = value_of(hidden_classes(parameters, {.dropped{0b1000}, .shown{0b1100}}));
    EXPECT_EQ(shown.hides[0], 1);
    EXPECT_EQ(std::count(shown.hides.begin(), shown.hides.end(), 0), 1);
    EXPECT_EQ(shown.hides[4], 0);
}

TEST(HiddenClasses, HaveNoRowInTheLegend) {
    const Model model = halves(false);
    const FieldColours colours = field_colours(0, kClass, {}, model.levels.back().fields[0]);
    const HiddenClasses hidden = value_of(hidden_classes(model.parameters, {.dropped{1U << kNoise}, .shown{}}));
    EXPECT_EQ(legend_of(colours)->rows.size(), 2U);
    ASSERT_EQ(legend_of(colours, &hidden)->rows.size(), 1U);
    EXPECT_EQ(legend_of(colours, &hidden)->rows[0].text, "2");
}

} // namespace
} // namespace pbm
