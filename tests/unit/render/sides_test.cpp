// Sides of points (BVG.md 19.4): every renderer shows the side of a thin wall that faces the eye, at every level.
#include "pbm_format/writing/writer.h"
#include "pbm_render/bricks/drawn_level.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/tables/table_renderer.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>

namespace pbm {
namespace {

constexpr int kSidesEdge = 96;

using DrawSides = std::function<Framebuffer(const Model &, const Camera &, int level)>;

template <class Renderer> Framebuffer draw_sides(const Model &model, const Camera &camera, int level, Storage storage) {
    const Bytes file = value_of(encode_model(model, {.storage = storage, .threads = 1}));
    StreamedModel streamed(value_of(Reader::open(file)));
    const Detail detail = value_of(streamed.load(
        {.camera = camera, .width = kSidesEdge, .height = kSidesEdge, .max_error = 0.01, .finest = level}));
    Framebuffer target(kSidesEdge, kSidesEdge);
    Renderer(model.parameters, kDefaultChunkPoints, 1).render(detail.runs, camera, {}, target);
    return target;
}

const std::array<std::pair<std::string, DrawSides>, 6> kSideRenderers{{
    {"reference",
     [](const Model &model, const Camera &camera, int level) {
         Framebuffer target(kSidesEdge, kSidesEdge);
         ReferenceRenderer(model).render(camera, {}, target, level);
         return target;
     }},
    {"tables",
     [](const Model &model, const Camera &camera, int level) {
         Framebuffer target(kSidesEdge, kSidesEdge);
         TableRenderer(model).render(camera, {}, target, {.level = level});
         return target;
     }},
    {"fast", [](const Model &m, const Camera &c, int l) { return draw_sides<FastRenderer>(m, c, l, Storage::packed); }},
    {"fast, mapped",
     [](const Model &m, const Camera &c, int l) { return draw_sides<FastRenderer>(m, c, l, Storage::mapped); }},
    {"fine", [](const Model &m, const Camera &c, int l) { return draw_sides<FineRenderer>(m, c, l, Storage::packed); }},
    {"fine, mapped",
     [](const Model &m, const Camera &c, int l) { return draw_sides<FineRenderer>(m, c, l, Storage::mapped); }},
}};

// Looks at the middle of the wall from above or from below.
Camera camera_beside_wall(bool above) {
    Camera camera;
    camera.focal_point = {8, 8, 8.5};
    camera.position = {8, 9, above ? 48 : -32};
    camera.up = {0, 1, 0};
    return camera;
}

TEST(DrawnSides, TheSideThatFacesTheEyeIsSeen) {
    for (const bool two_layers : {false, true})
        for (const bool closed : {false, true}) {
            Model model = test::thin_wall(two_layers);
            model.parameters.closed = closed;
            gather_sides(model, 1);
            for (const auto &[name, draw] : kSideRenderers)
                for (int level = 3; level <= model.parameters.grid.depth; ++level)
                    for (const bool above : {false, true}) {
                        SCOPED_TRACE(name + ", level " + std::to_string(level) + (above ? ", above" : ", below"));
                        const Framebuffer target = draw(model, camera_beside_wall(above), level);
                        for (const int at : {40, 48, 53}) {
                            const std::uint32_t pixel =
                                target.colour[static_cast<std::size_t>(at) * kSidesEdge + static_cast<std::size_t>(at)];
                            const unsigned red = pixel & 255, blue = pixel >> 16 & 255;
                            EXPECT_GT(above ? red : blue, 4 * (above ? blue : red)) << at;
                        }
                    }
        }
}

TEST(DrawnSides, AreRunsOfTheirOwnThatKnowTheirPoints) {
    Model model = test::thin_wall(false);
    const Bytes file = value_of(encode_model(model, {.threads = 1}));
    StreamedModel streamed(value_of(Reader::open(file)));
    const Detail detail = value_of(streamed.load({.camera = camera_beside_wall(true), .width = 96, .height = 96}));
    ASSERT_EQ(detail.runs.size(), 2U);
    EXPECT_EQ(detail.runs[0].origins, nullptr);
    ASSERT_NE(detail.runs[1].origins, nullptr);
    EXPECT_EQ(detail.runs[1].last - detail.runs[1].first, model.levels.back().sides.size());
    for (std::uint32_t i = detail.runs[1].first; i < detail.runs[1].last; ++i)
        EXPECT_EQ(detail.runs[1].origins[i], i);
    const DrawnLevel level(model, 4);
    EXPECT_EQ(level.second(7), model.point_count() + 7);
    EXPECT_EQ(level.origin(model.point_count() + 7), 7U);
    EXPECT_EQ(DrawnLevel(test::sphere_model(3, {}), 3).second(7), std::nullopt);
}

} // namespace
} // namespace pbm
