// Sides of points: both storage profiles, the law that nothing else of a file depends on them, damage, and how coarser
// levels get theirs. BVG.md 19
#include "pbm_format/checking/validate.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/reading/point_stream_reader.h"
#include "pbm_format/writing/model_edit.h"
#include "pbm_format/writing/writer.h"
#include "unit/support/file_damage.h"
#include "unit/support/file_editor.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

namespace pbm {
namespace {

using namespace test;

constexpr std::uint32_t kChunkPoints = 512;
constexpr int kDepth = 6;

Model without_sides() { return sphere_model(kDepth, every_attribute(ColourFormat::rgb888, kDepth)); }

Model model_with_sides() {
    Model model = without_sides();
    add_sides(model);
    return model;
}

Bytes encoded(const Model &model, Storage storage = Storage::packed) {
    return value_of(encode_model(model, {.storage = storage, .chunk_points = kChunkPoints}));
}

TEST(Sides, ComeBackFromBothStorageProfiles) {
    const Model model = model_with_sides();
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes file = encoded(model, storage);
        Result<Reader> reader = Reader::open(file);
        ASSERT_TRUE(reader) << reader.error().message;
        EXPECT_EQ(reader->header().minor, 4);
        const Result<Model> loaded = load_model(*reader);
        ASSERT_TRUE(loaded) << loaded.error().message;
        EXPECT_TRUE(*loaded == model);
        EXPECT_EQ(value_of(count_sides(*reader, kDepth)), model.levels.back().sides.size());
        EXPECT_EQ(value_of(count_sides(*reader, 0)), 0U);
        const ValidationReport report = validate(file, {.level = ValidationLevel::deep, .least = Severity::warning});
        EXPECT_EQ(report.errors + report.warnings, 0U) << report.findings.front().message;
    }
}

TEST(Sides, NothingElseDependsOnThem) {
    Model model = without_sides();
    const Bytes without = encoded(model);
    add_sides(model);
    for (std::size_t level = 1; level < model.levels.size() - 1; ++level)
        model.levels[level].sides = {};
    const Bytes with = encoded(model);
    const Reader reader = value_of(Reader::open(with)), plain = value_of(Reader::open(without));
    EXPECT_EQ(reader.header().content_id, plain.header().content_id);
    EXPECT_EQ(plain.header().minor, 0);
    EXPECT_EQ(reader.sections().size(), plain.sections().size() + 2); // only of the level that has some
    for (const SectionEntry &section : plain.sections()) {
        if (section.type == SectionType::level_directory && section.instance == kDepth)
            continue; // chunks with sides have no normal cone
        EXPECT_EQ(section.hash, reader.section(section.type, section.instance)->hash) << to_string(section.type);
    }
}

TEST(Sides, AModelWithoutThemIsTheSameFile) {
    Model model = without_sides();
    const Bytes before = encoded(model);
    gather_sides(model, 1); // of a sphere
    EXPECT_EQ(encoded(model), before);
}

TEST(Sides, EveryChangedByteIsFound) {
    expect_changes_are_found(encoded(model_with_sides()), PointStream::sides, kDepth);
}

TEST(Sides, AnEditKeepsThemAndMovesTheirShadows) {
    const Model model = model_with_sides();
    const Bytes file = encoded(model);
    ModelEdit edit(value_of(Reader::open(file)));
    edit.parameters.materials.front().ka = 0.5F;
    const auto load = [](const Bytes &bytes) {
        Reader reader = value_of(Reader::open(bytes));
        return value_of(load_model(reader));
    };
    EXPECT_EQ(load(value_of(edited_model(file, edit))).levels.back().sides, model.levels.back().sides);
    edit.shadows = {{.light = 0, .finest = Bytes(model.point_count(), 1), .ground = {}}};
    const Model moved = load(value_of(edited_model(file, edit)));
    const Bytes &lit = moved.levels.back().sides.values.shadows[0];
    EXPECT_EQ(lit, Bytes(lit.size(), 1));
    EXPECT_EQ(moved.levels.back().sides.values.shadows[1], model.levels.back().sides.values.shadows[1]);
}

TEST(Sides, AnEditLeavesUnknownPointStreamsOut) {
    FileEditor unknown(encoded(model_with_sides()));
    for (const SectionType type : {SectionType::stream_directory, SectionType::stream_values})
        for (int level = 1; level <= kDepth; ++level)
            unknown.set<std::uint32_t>(unknown.entry(type, instance_of(PointStream::sides, level)) + 8,
                                       2 * kStreamKinds + static_cast<std::uint32_t>(level)); // has no meaning
    unknown.repair();
    EXPECT_TRUE(validate(unknown.bytes()).valid());
    const Reader before = value_of(Reader::open(unknown.bytes()));
    const Reader after = value_of(Reader::open(value_of(edited_model(unknown.bytes(), ModelEdit(before)))));
    EXPECT_EQ(after.sections().size() + 2 * kDepth, before.sections().size());
    EXPECT_EQ(after.header().minor, 0);
}

TEST(Sides, CoarserLevelsHaveThoseOfThePointsBelow) {
    for (const bool two_layers : {false, true}) {
        Model model = thin_wall(two_layers);
        gather_sides(model, 1);
        EXPECT_EQ(model.levels[0].sides.size(), 0U);
        EXPECT_EQ(model.levels.back().sides.size(), two_layers ? 0U : 256U);
        for (std::size_t level = 1; level < model.levels.size() - 1; ++level) {
            const Sides &sides = model.levels[level].sides;
            // None where they would be fewer than 64.
            ASSERT_EQ(sides.size(), level < 3 ? 0U : model.levels[level].points.size()) << level;
            for (std::size_t i = 0; i < 2 * sides.size(); ++i) {
                const bool is_up = normal_table()[sides.values.normals[i]][2] > 0.99;
                EXPECT_TRUE(is_up || normal_table()[sides.values.normals[i]][2] < -0.99);
                EXPECT_EQ(point_colour(sides.values.colours, i, ColourFormat::rgb888),
                          is_up ? (Rgb8{220, 40, 40}) : (Rgb8{40, 40, 220}));
            }
        }
        Model threads = thin_wall(two_layers);
        gather_sides(threads, 3);
        EXPECT_TRUE(threads == model);
        EXPECT_TRUE(validate(encoded(model), {.level = ValidationLevel::deep}).valid());
    }
}

TEST(Sides, SidesThatLookAlikeAreLeftOut) {
    Model model = thin_wall(false);
    for (std::size_t i = 0; i < model.levels.back().sides.size(); ++i)
        for (std::size_t side = 0; side < 2; ++side)
            set_point_colour(model.levels.back().sides.values, 2 * i + side, ColourFormat::rgb888, {160, 40, 160});
    gather_sides(model, 1);
    for (const Level &level : model.levels)
        EXPECT_EQ(level.sides.size(), 0U);
}

// The shadow of a point whose sides are both lit is that of neither.
TEST(Sides, SidesWithOtherLightThanTheirPointAreKept) {
    Model model = thin_wall(false);
    AttributeSet &set = model.parameters.attributes;
    set = {.lights = 1, .shadow_bits = {{{4, 4, 4, 4, 1}}}};
    model.parameters.lights.resize(1);
    Level &finest = model.levels.back();
    finest.points.colours = finest.sides.values.colours = {};
    finest.sides.values.shadows[0].assign(2 * finest.sides.size(), 1);
    for (const std::uint8_t lit : {std::uint8_t{1}, std::uint8_t{0}}) {
        Model lit_model = model;
        lit_model.levels.back().points.shadows[0].assign(model.point_count(), lit);
        average_levels(lit_model, 1);
        gather_sides(lit_model, 1);
        EXPECT_EQ(lit_model.levels.back().sides.size(), lit == 1 ? 0U : 256U);
    }
}

// An edge of 90 degrees is one surface.
TEST(Sides, ACreaseHasNone) {
    Model model = thin_wall(true);
    for (std::size_t i = 0; i < model.point_count(); ++i) {
        std::uint16_t &normal = model.levels.back().points.normals[i];
        if (normal == quantise_normal(0, 0, -1))
            normal = quantise_normal(1, 0, 0);
    }
    average_levels(model, 1);
    gather_sides(model, 1);
    for (const Level &level : model.levels)
        EXPECT_EQ(level.sides.size(), 0U);
}

} // namespace
} // namespace pbm
