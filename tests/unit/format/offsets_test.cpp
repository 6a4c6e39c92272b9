// Surface offsets in files: both storage profiles, the law that nothing else of a file depends on them, damage, edits.
// BVG.md 19.6
#include "pbm_format/checking/validate.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/reading/point_stream_reader.h"
#include "pbm_format/writing/model_edit.h"
#include "pbm_format/writing/writer.h"
#include "unit/support/file_damage.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

namespace pbm {
namespace {

using namespace test;

constexpr int kOffsetDepth = 6;

Model model_without_offsets() {
    return sphere_model(kOffsetDepth, every_attribute(ColourFormat::rgb888, kOffsetDepth));
}

Model model_with_offsets() {
    Model model = model_without_offsets();
    add_offsets(model);
    return model;
}

Bytes encode_offset_model(const Model &model, Storage storage = Storage::packed) {
    return value_of(encode_model(model, {.storage = storage, .chunk_points = 512}));
}

Model decode_offset_model(const Bytes &file) {
    Reader reader = value_of(Reader::open(file));
    return value_of(load_model(reader));
}

TEST(Offsets, ComeBackFromBothStorageProfilesAndBesideSides) {
    Model model = model_with_offsets();
    for (const bool with_sides : {false, true}) {
        if (with_sides)
            add_sides(model);
        for (const Storage storage : {Storage::packed, Storage::mapped}) {
            const Bytes file = encode_offset_model(model, storage);
            Reader reader = value_of(Reader::open(file));
            EXPECT_EQ(reader.header().minor, 6);
            EXPECT_TRUE(value_of(load_model(reader)) == model);
            EXPECT_EQ(value_of(count_offsets(reader, kOffsetDepth)), model.levels.back().offsets.size());
            EXPECT_EQ(value_of(count_offsets(reader, 0)), 0U);
            const ValidationReport report =
                validate(file, {.level = ValidationLevel::deep, .least = Severity::warning});
            EXPECT_EQ(report.errors + report.warnings, 0U) << report.findings.front().message;
        }
    }
}

TEST(Offsets, NothingElseDependsOnThem) {
    Model model = model_without_offsets();
    const Bytes without = encode_offset_model(model);
    add_offsets(model);
    for (std::size_t level = 1; level < model.levels.size() - 1; ++level)
        model.levels[level].offsets = {};
    const Bytes with = encode_offset_model(model);
    const Reader reader = value_of(Reader::open(with)), plain = value_of(Reader::open(without));
    EXPECT_EQ(reader.header().content_id, plain.header().content_id);
    EXPECT_EQ(reader.sections().size(), plain.sections().size() + 2); // only of the level that has some
    for (const SectionEntry &section : plain.sections())
        EXPECT_EQ(section.hash, reader.section(section.type, section.instance)->hash) << to_string(section.type);
}

TEST(Offsets, EveryChangedByteIsFound) {
    expect_changes_are_found(encode_offset_model(model_with_offsets()), PointStream::offsets, kOffsetDepth);
}

TEST(Offsets, AnEditKeepsThem) {
    const Model model = model_with_offsets();
    const Bytes file = encode_offset_model(model);
    ModelEdit edit(value_of(Reader::open(file)));
    edit.parameters.materials.front().ka = 0.5F;
    EXPECT_EQ(decode_offset_model(value_of(edited_model(file, edit))).levels.back().offsets,
              model.levels.back().offsets);
    edit.shadows = {{.light = 0, .finest = Bytes(model.point_count(), 1), .ground = {}}};
    EXPECT_EQ(decode_offset_model(value_of(edited_model(file, edit))).levels.back().offsets,
              model.levels.back().offsets);
}

} // namespace
} // namespace pbm
