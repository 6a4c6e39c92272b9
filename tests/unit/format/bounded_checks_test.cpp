// A check decodes a model chunk by chunk: what it finds depends neither on its memory nor on its threads.
#include "pbm_format/checking/validate.h"
#include "pbm_format/writing/writer.h"
#include "system/files/mapped_file.h"
#include "unit/support/file_damage.h"
#include "unit/support/file_editor.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace pbm {
namespace {

using namespace test;

ValidationReport report_of(ByteView file, std::uint64_t max_memory, int threads) {
    return validate(file, {.threads = threads, .least = Severity::info, .max_memory = max_memory});
}

// The least memory in which the file can be checked, as the refusal of less says. 0: it is refused before that.
std::uint64_t least_memory(ByteView file) {
    const ValidationReport refused = report_of(file, 1, 1);
    if (refused.findings.empty() || refused.findings.back().entry->name != "system.memory")
        return 0;
    return std::get<std::uint64_t>(refused.findings.back().actual.held());
}

void expect_same(const ValidationReport &report, const ValidationReport &expected, const std::string &name) {
    EXPECT_EQ(report.totals, expected.totals) << name;
    EXPECT_EQ(report.points, expected.points) << name;
    EXPECT_EQ(report.chunks, expected.chunks) << name;
    EXPECT_EQ(report.exit_code, expected.exit_code) << name;
    ASSERT_EQ(report.findings.size(), expected.findings.size()) << name;
    for (std::size_t i = 0; i < report.findings.size(); ++i) {
        const Finding &is = report.findings[i], &should = expected.findings[i];
        EXPECT_EQ(is.message, should.message) << name;
        EXPECT_EQ(is.offset, should.offset) << name;
        EXPECT_EQ(is.section, should.section) << name;
        EXPECT_EQ(is.chunk, should.chunk) << name;
        EXPECT_EQ(is.tile, should.tile) << name;
        EXPECT_EQ(is.entry, should.entry) << name;
    }
}

void expect_same_with_any_memory(ByteView file, const std::string &name) {
    const ValidationReport expected = report_of(file, kDefaultMaxMemory, 1);
    expect_same(report_of(file, kDefaultMaxMemory, 4), expected, name + ", 4 threads");
    if (const std::uint64_t least = least_memory(file); least > 0) {
        expect_same(report_of(file, least, 4), expected, name + ", the least memory");
        expect_same(report_of(file, 2 * least, 4), expected, name + ", twice the least memory");
        EXPECT_EQ(report_of(file, least - 1, 1).findings.back().entry->name, "system.memory") << name;
    }
}

TEST(BoundedChecks, FindTheSameInEveryVectorWithAnyMemory) {
    for (const char *folder : {"valid", "invalid", "advised"})
        for (const auto &entry : std::filesystem::directory_iterator(
                 std::filesystem::path(PBM_SOURCE_DIR "/format_spec/vectors") / folder)) {
            const MappedFile file = value_of(MappedFile::open(entry.path().string()));
            expect_same_with_any_memory(file.bytes(), entry.path().filename().string());
        }
}

// 13,000 points in chunks of 512. Their hashes alone take more memory than the least: the chunks are decoded twice.
Model large_model() {
    Model model = sphere_model(6, {.colour = ColourFormat::rgb888, .material = true});
    add_fields(model);
    return model;
}

Bytes in_small_chunks(const Model &model, Storage storage = Storage::packed) {
    return value_of(encode_model(model, {.storage = storage, .chunk_points = 512, .threads = 1}));
}

TEST(BoundedChecks, FindTheSameInLargeModelsWithAnyMemory) {
    const Model model = large_model();
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        Bytes file = in_small_chunks(model, storage);
        EXPECT_TRUE(validate(file, {.threads = 1, .max_memory = least_memory(file)}).valid());
        expect_same_with_any_memory(file, "valid");
        FileEditor wrong_id(file);
        wrong_id.flip(8 * 72);
        wrong_id.repair();
        expect_same_with_any_memory(wrong_id.bytes(), "wrong content_id");
        for (std::size_t at = file.size() / 4; at < file.size(); at += file.size() / 9)
            file[at] ^= 1;
        expect_same_with_any_memory(file, "damaged");
    }
}

// The first error of `verify` is the first finding of `validate`: of the coarsest level, though chunks of finer ones
// are decoded before.
TEST(BoundedChecks, VerifyReportsTheFirstFinding) {
    const Bytes file = in_small_chunks(large_model());
    Random random(3);
    for (int i = 0; i < 50; ++i) {
        FileEditor editor(file);
        for (int flips = 0; flips < 3; ++flips)
            editor.flip(static_cast<std::size_t>(8 * (file.size() / 2 + random.below(file.size() / 2))));
        editor.repair();
        for (const int threads : {1, 4}) {
            const Status status = verify(editor.bytes(), {.threads = threads});
            const ValidationReport report = validate(editor.bytes(), {.threads = threads});
            ASSERT_EQ(status.ok(), report.valid());
            if (!status) {
                EXPECT_EQ(status.error().message, report.findings[0].message);
                EXPECT_EQ(status.error().offset, report.findings[0].offset);
            }
        }
    }
}

// Of each level the first wrong point is found, wherever it lies: below the roots of chunks or above them.
TEST(BoundedChecks, FindTheFirstWrongAverageOfEachLevel) {
    const Model model = large_model();
    Random random(5);
    for (int i = 0; i < 40; ++i) {
        Model wrong = model;
        std::vector<std::string> expected;
        for (std::size_t level = 0; level < 6; ++level) {
            PointAttributes &points = wrong.levels[level].points;
            const auto first = static_cast<std::size_t>(random.below(points.size()));
            const auto second = first + static_cast<std::size_t>(random.below(points.size() - first));
            points.colours[3 * second] ^= 1;
            if (i % 2 == 0)
                points.normals[first] ^= 1;
            else
                points.materials[first] = static_cast<std::uint8_t>((points.materials[first] + 1) % 3);
            expected.push_back("7.1 level " + std::to_string(level) +
                               " does not hold the averages of the finest points: ");
            const bool colour = first == second && i % 2 != 0;
            expected.back() += colour ? "colour" : i % 2 == 0 ? "normal" : "material";
            expected.back() += " of point " + std::to_string(first);
        }
        const ValidationReport report = validate(in_small_chunks(wrong), {.threads = 2});
        ASSERT_EQ(report.findings.size(), expected.size());
        for (std::size_t level = 0; level < 6; ++level)
            EXPECT_EQ(report.findings[level].message, expected[level]);
    }
}

TEST(BoundedChecks, FindTheFirstWrongValueOfEachFieldAndLevel) {
    const Model model = large_model();
    Random random(6);
    for (int i = 0; i < 10; ++i) {
        Model wrong = model;
        std::vector<std::string> expected;
        for (std::size_t level = 0; level < 6; ++level)
            for (std::size_t f = 0; f < model.parameters.fields.size(); ++f) {
                const Field &field = model.parameters.fields[f];
                const auto point = static_cast<std::size_t>(random.below(wrong.levels[level].points.size()));
                wrong.levels[level].fields[f][field.bytes * point] ^= 1;
                expected.push_back("17.3.1 level " + std::to_string(level) +
                                   " does not hold the averages of the finest points: " + field.name + " of point " +
                                   std::to_string(point));
            }
        const ValidationReport report = validate(in_small_chunks(wrong), {.threads = 2});
        ASSERT_EQ(report.findings.size(), expected.size());
        for (std::size_t at = 0; at < expected.size(); ++at)
            EXPECT_EQ(report.findings[at].message, expected[at]);
    }
}

} // namespace
} // namespace pbm
