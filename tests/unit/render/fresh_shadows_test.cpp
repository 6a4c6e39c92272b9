// Shadows that were baked anew look as if they were in the file; those that were dropped are gone.
#include "unit/render/surroundings_test_model.h"

#include "pbm_render/bricks/shadow_stream.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/surroundings/texel_levels.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

namespace pbm {
namespace {

using namespace test;

const Camera kBeside = look_from({1.5, 0.7, 2.5}, {0, -1.4, -2});

// A ball with a second light; both lights have streams of 8 bits and rasters.
Model shadowed_ball(std::uint64_t seed, std::uint8_t ground) {
    AttributeSet set{.lights = 2};
    set.shadow_bits[0].fill(8);
    set.shadow_bits[1].fill(8);
    Model model = ball_on_ground(set);
    model.parameters.lights.resize(2);
    model.parameters.lights[1] = {.kind = LightKind::point, .intensity = {1, 0.5F, 0.2F}, .position = {3, 4, 5}};
    Random random(seed);
    Bytes &lit = model.levels.back().points.shadows[1];
    for (std::uint8_t &value : lit)
        value = static_cast<std::uint8_t>(random.below(256));
    average_levels(model, 1);
    model.images.ground_lit = {raster(64, 128), raster(64, ground)};
    return model;
}

std::vector<Framebuffer> shadowed_pictures(const Model &model, const ShadowSource &source,
                                           const RenderOptions &options) {
    const Bytes file = value_of(encode_model(model, {.storage = Storage::mapped, .chunk_points = 512, .threads = 1}));
    Appearance appearance(model.parameters);
    appearance.shadows[1] = source;
    std::vector<Framebuffer> pictures(3, Framebuffer(160, 120));
    for (const int level : {model.parameters.grid.depth, model.parameters.grid.depth - 1}) {
        const WholeLevel whole(file, level);
        FastRenderer fast(model.parameters, 512, 2, surroundings_of(model));
        fast.set_appearance(appearance);
        fast.render(whole.runs, kBeside, options, pictures[0]);
        FineRenderer fine(model.parameters, 512, 2, surroundings_of(model));
        fine.set_appearance(appearance);
        fine.render(whole.runs, kBeside, options, pictures[1], 2);
        ReferenceRenderer reference(model, surroundings_of(model));
        reference.set_appearance(appearance);
        reference.render(kBeside, options, pictures[2], {.level = level});
    }
    return pictures;
}

void expect_same_pictures(const std::vector<Framebuffer> &a, const std::vector<Framebuffer> &b) {
    for (std::size_t i = 0; i < a.size(); ++i)
        EXPECT_EQ(a[i].colour, b[i].colour) << i;
}

TEST(FreshShadows, LookAsIfTheyWereInTheFile) {
    const Model stored = shadowed_ball(1, 200), other = shadowed_ball(2, 30);
    auto fresh = std::make_shared<LitFractions>();
    for (const Level &level : other.levels)
        fresh->levels.push_back(level.points.shadows[1]);
    fresh->ground = std::make_shared<const TexelLevels>(
        std::vector{std::make_shared<const TiledImage>(TiledImage::of(other.images.ground_lit[1]))}, std::uint8_t{255});
    const auto wanted = shadowed_pictures(other, {}, {}), before = shadowed_pictures(stored, {}, {});
    expect_same_pictures(shadowed_pictures(stored, {.of_file = false, .fresh = fresh}, {}), wanted);
    for (std::size_t i = 0; i < wanted.size(); ++i)
        EXPECT_NE(wanted[i].colour, before[i].colour) << i;
    // Fractions of another model are no reason to read beyond them.
    auto foreign = std::make_shared<LitFractions>();
    foreign->levels.assign(fresh->levels.size(), Bytes(3));
    const Bytes file = value_of(encode_model(stored, {.storage = Storage::mapped, .chunk_points = 512, .threads = 1}));
    const WholeLevel whole(file, stored.parameters.grid.depth);
    const ShadowStream stream =
        shadow_stream(whole.runs.back(), 1, stored.parameters.attributes, {.of_file = false, .fresh = foreign});
    EXPECT_EQ(stream.lit(0), 1);
    EXPECT_EQ(stream.lit(kDefaultChunkPoints - 1), 1);
}

TEST(FreshShadows, ThatAreDroppedLeaveTheLightWithoutShadow) {
    Model stored = shadowed_ball(1, 200), lit = stored;
    lit.levels.back().points.shadows[1].assign(lit.point_count(), 255);
    average_levels(lit, 1);
    lit.images.ground_lit[1].texels.assign(lit.images.ground_lit[1].texels.size(), 255);
    expect_same_pictures(shadowed_pictures(stored, {.of_file = false, .fresh = nullptr}, {}),
                         shadowed_pictures(lit, {}, {}));
}

} // namespace
} // namespace pbm
