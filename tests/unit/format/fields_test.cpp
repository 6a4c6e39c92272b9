// Fields of points: averages, both storage profiles, the law that nothing else of a file depends on them. BVG.md 17
#include "pbm_format/checking/validate.h"
#include "pbm_format/reading/field_reader.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/model_edit.h"
#include "pbm_format/writing/writer.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

namespace pbm {
namespace {

using namespace test;

constexpr std::uint32_t kChunkPoints = 512;

Model without_fields() { return sphere_model(6, {.colour = ColourFormat::rgb888}); }

Model model_with_fields() {
    Model model = without_fields();
    add_fields(model);
    return model;
}

Bytes encoded(const Model &model, Storage storage = Storage::packed) {
    Result<Bytes> file = encode_model(model, {.storage = storage, .chunk_points = kChunkPoints});
    EXPECT_TRUE(file) << file.error().message;
    return std::move(*file);
}

// The figure of BVG.md 17.3: a root with two octants of three and two voxels.
TEST(Fields, AveragesAreThoseOfTheFigure) {
    Model model;
    model.parameters.grid.depth = 2;
    model.parameters.attributes = {};
    const std::array<MortonCode, 5> codes{0, 1, 2, 56, 57};
    const LevelMasks masks = encode_octree(codes, 2);
    model.levels.resize(3);
    for (std::size_t level = 0; level < 3; ++level)
        model.levels[level].masks = masks[level];
    for (const FieldAverage average : {FieldAverage::mean, FieldAverage::majority, FieldAverage::maximum})
        model.parameters.fields.push_back({.name = std::string(to_string(average)), .unit = "", .average = average});
    model.levels[2].fields.assign(3, Bytes{10, 13, 0, 20, 10});
    average_fields(model, 1);
    const std::vector<Bytes> octants{{12, 15}, {10, 10}, {13, 20}}, root{{13}, {10}, {20}};
    EXPECT_EQ(model.levels[1].fields, octants);
    EXPECT_EQ(model.levels[0].fields, root);
}

TEST(Fields, ComeBackFromBothStorageProfiles) {
    const Model model = model_with_fields();
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes file = encoded(model, storage);
        Result<Reader> reader = Reader::open(file);
        ASSERT_TRUE(reader) << reader.error().message;
        EXPECT_EQ(reader->header().minor, 1);
        EXPECT_EQ(reader->header().optional_features, kFieldsFeature);
        const Result<Model> loaded = load_model(*reader, {.fields = true});
        ASSERT_TRUE(loaded) << loaded.error().message;
        EXPECT_TRUE(*loaded == model);
        const ValidationReport report = validate(file, {.least = Severity::info});
        EXPECT_EQ(report.errors + report.warnings, 0U) << report.findings.front().message;
    }
}

TEST(Fields, NothingElseDependsOnThem) {
    const Bytes with = encoded(model_with_fields()), without = encoded(without_fields());
    Result<Reader> reader = Reader::open(with), plain = Reader::open(without);
    ASSERT_TRUE(reader && plain);
    EXPECT_EQ(reader->header().content_id, plain->header().content_id);
    EXPECT_EQ(plain->header().minor, 0);
    Result<Model> loaded = load_model(*reader);
    const Result<Model> other = load_model(*plain);
    ASSERT_TRUE(loaded && other);
    EXPECT_TRUE(*loaded == *other);
}

TEST(Fields, AFilterSavesBytes) {
    const Model model = model_with_fields();
    const auto stored = [&](bool filters) {
        const Bytes file = value_of(encode_model(model, {.filters = filters, .chunk_points = kChunkPoints}));
        return value_of(Reader::open(file)).section(SectionType::field_values, 6)->stored_bytes;
    };
    EXPECT_LT(stored(true), stored(false));
}

TEST(Fields, EveryChangedByteIsFound) {
    const Bytes file = encoded(model_with_fields());
    const Result<Reader> reader = Reader::open(file);
    ASSERT_TRUE(reader);
    for (const SectionType type : {SectionType::fields, SectionType::field_directory, SectionType::field_values}) {
        const SectionEntry *section = reader->section(type, type == SectionType::fields ? 0 : 6);
        const std::uint64_t step = 1 + section->stored_bytes / 40;
        for (std::uint64_t at = 0; at < section->stored_bytes; at += step) {
            Bytes damaged = file;
            damaged[section->offset + at] ^= 0x10;
            const ValidationReport report = validate(damaged);
            ASSERT_FALSE(report.valid()) << to_string(type) << " " << at;
            Result<Reader> other = Reader::open(damaged);
            EXPECT_FALSE(other && load_model(*other, {.fields = true})) << to_string(type) << " " << at;
            // The points do not depend on directory and values.
            EXPECT_EQ(other && load_model(*other), type != SectionType::fields);
        }
    }
}

TEST(Fields, AWrongAverageIsFound) {
    for (std::size_t f = 0; f < 3; ++f)
        for (const std::size_t level : {0U, 3U}) {
            Model model = model_with_fields();
            Bytes &column = model.levels[level].fields[f];
            column[0] = static_cast<std::uint8_t>(column[0] == 1 ? 2 : 1);
            const ValidationReport report = validate(encoded(model));
            ASSERT_EQ(report.errors, 1U);
            EXPECT_EQ(report.findings.front().rule, "17.3.1");
            EXPECT_EQ(report.findings.front().section, level == 0 ? "fields" : "level 3 field values");
        }
}

TEST(Fields, AnEditKeepsThem) {
    const Model model = model_with_fields();
    const Bytes file = encoded(model);
    const Result<Reader> reader = Reader::open(file);
    ASSERT_TRUE(reader);
    ModelEdit edit(*reader);
    edit.parameters.materials.front().ka = 0.5F;
    const Result<Bytes> edited = edited_model(file, edit);
    ASSERT_TRUE(edited) << edited.error().message;
    Result<Reader> after = Reader::open(*edited);
    ASSERT_TRUE(after);
    const Result<Model> loaded = load_model(*after, {.fields = true});
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->parameters.fields, model.parameters.fields);
    EXPECT_EQ(loaded->levels.back().fields, model.levels.back().fields);
    EXPECT_TRUE(verify(*edited));
    edit.parameters.fields.pop_back();
    EXPECT_FALSE(edited_model(file, edit));
}

TEST(Fields, TheWriterRefusesWhatAReaderWould) {
    const auto refuses = [](const auto &change) {
        Model model = model_with_fields();
        change(model.parameters.fields.front());
        return !encode_model(model);
    };
    EXPECT_FALSE(refuses([](Field &) {}));
    EXPECT_TRUE(refuses([](Field &field) { field.name = "height"; }));
    EXPECT_TRUE(refuses([](Field &field) { field.name = ""; }));
    EXPECT_TRUE(refuses([](Field &field) { field.name = "a\nb"; }));
    EXPECT_TRUE(refuses([](Field &field) { field.name = "\xC0\x80"; }));
    EXPECT_TRUE(refuses([](Field &field) { field.scale = 0; }));
    EXPECT_TRUE(refuses([](Field &field) { field.scale = 1e308; }));
    EXPECT_TRUE(refuses([](Field &field) { field.offset = std::nan(""); }));
    EXPECT_TRUE(refuses([](Field &field) { field.average = FieldAverage{3}; }));
}

} // namespace
} // namespace pbm
