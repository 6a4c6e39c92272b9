// The catalogue of findings: its names are frozen, each rule occurs once, and an error carries code, rule and values.
#include "pbm_format/checking/validate.h"
#include "pbm_format/law/catalogue.h"
#include "pbm_format/model/octree.h"
#include "pbm_format/writing/writer.h"
#include "system/files/mapped_file.h"

#include "unit/support/file_editor.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <sstream>

namespace pbm {
namespace {

TEST(Catalogue, NamesAreAGroupAndAWordAndThereOnce) {
    std::set<std::string_view> names;
    for (const CatalogueEntry &entry : kCatalogue) {
        EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
        EXPECT_EQ(entry.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz_."), std::string_view::npos) << entry.name;
        EXPECT_EQ(std::count(entry.name.begin(), entry.name.end(), '.'), 1) << entry.name;
        EXPECT_EQ(find_code(entry.name), &entry);
        EXPECT_EQ(find_code(entry.group()), nullptr) << "a group is no code";
        for (const std::string_view line : {entry.meaning, entry.remedy}) {
            EXPECT_TRUE(line.ends_with('.')) << entry.name;
            EXPECT_EQ(line.find_first_of("\n|"), std::string_view::npos) << entry.name << ": no cell of a table";
        }
    }
}

TEST(Catalogue, EachRuleBelongsToOneCode) {
    std::set<std::string> rules;
    for (const CatalogueEntry &entry : kCatalogue) {
        std::istringstream in{std::string(entry.rules)};
        for (std::string rule; in >> rule;) {
            EXPECT_TRUE(rules.insert(rule).second) << rule;
            EXPECT_EQ(find_rule(rule), &entry) << rule;
            EXPECT_EQ(entry.severity, Severity::error) << entry.name;
        }
    }
    EXPECT_EQ(rules.size(), 179U);
    EXPECT_EQ(find_rule(""), nullptr);
    EXPECT_EQ(find_rule("2"), nullptr);
    EXPECT_EQ(find_rule("4.2 "), nullptr);
}

TEST(Catalogue, AnErrorCarriesCodeRuleAndValues) {
    const Error error = broken("2.9", 36, "depth is not 2..16", "2..16", std::uint8_t{17});
    EXPECT_EQ(error.code, ErrorCode::bad_header);
    EXPECT_EQ(error.message, "2.9 depth is not 2..16");
    EXPECT_EQ(error.name, "header.field");
    EXPECT_EQ(error.rule, "2.9");
    EXPECT_EQ(to_string(error.expected), "2..16");
    EXPECT_EQ(std::get<std::uint64_t>(error.actual.held()), 17U);
    EXPECT_EQ(entry_of(error), find_code("header.field"));
    EXPECT_EQ(entry_of({ErrorCode::io, 0, "any"})->name, "io.read");
    EXPECT_EQ(entry_of({ErrorCode::memory, 0, "any"})->name, "system.memory");
}

TEST(Catalogue, ValuesAreNumbersOrText) {
    EXPECT_TRUE(Value().empty());
    EXPECT_EQ(to_string(Value()), "");
    EXPECT_EQ(to_string(Value(-3)), "-3");
    EXPECT_EQ(to_string(Value(~std::uint64_t{0})), "18446744073709551615");
    EXPECT_EQ(to_string(Value(0.5F)), "0.5");
    EXPECT_EQ(to_string(Value(std::numeric_limits<double>::quiet_NaN())), "nan");
    EXPECT_EQ(to_string(Value(-std::numeric_limits<double>::infinity())), "-inf");
    EXPECT_EQ(to_string(hash_value(0x0123456789ABCDEF)), "0x0123456789abcdef");
}

TEST(Catalogue, RulesForCallersHaveCodesToo) {
    const std::array<std::uint8_t, 2> masks{3, 1};
    const std::array<MortonCode, 2> parents{0, 1};
    EXPECT_EQ(expand_level(std::span(parents).first(1), masks, 9).error().name, "octree.mask_count");
    EXPECT_EQ(expand_level(parents, masks, 2).error().name, "limit.nodes");
}

TEST(Catalogue, TheSystemHasCodes) {
    EXPECT_EQ(MappedFile::open("/no/such/file").error().name, "io.open");
    EXPECT_EQ(MappedFile::open("/").error().name, "io.not_a_file");
    EXPECT_EQ(MappedFile::open("/dev/zero").error().name, "io.not_a_file");
    const Result<MappedFile> folder = MappedFile::read_stream("/", 1000);
    ASSERT_FALSE(folder);
    EXPECT_EQ(entry_of(folder.error())->name, "io.read");
}

TEST(Catalogue, AStreamIsReadAsFarAsItIsWanted) {
    const auto first = MappedFile::read_stream("/dev/zero", 1 << 30, [](ByteView start) { return start.size(); });
    ASSERT_TRUE(first);
    EXPECT_GE(first->bytes().size(), MappedFile::kStreamStart);
    EXPECT_LE(first->bytes().size(), std::size_t{1} << 20);
}

// Many chunks, every one of them damaged.
Bytes damaged_chunks() {
    test::FileEditor editor(value_of(encode_model(test::sphere_model(5, {}), {.chunk_points = 512, .threads = 1})));
    const std::size_t at = editor.section(SectionType::level_chunks, 5);
    const std::uint64_t size = editor.get<std::uint64_t>(editor.entry(SectionType::level_chunks, 5) + 32);
    for (std::size_t i = 0; i < size; i += 16)
        editor.flip(8 * (at + i));
    editor.repair(false);
    return editor.bytes();
}

TEST(Validation, CapsHideNoneOfTheCounts) {
    const Bytes file = damaged_chunks();
    const ValidationReport all = validate(file, {.threads = 1});
    ASSERT_GT(all.total, 5U);
    EXPECT_EQ(all.findings.size(), all.total);
    EXPECT_EQ(all.exit_code, 3);
    const ValidationReport few = validate(file, {.threads = 1, .max_per_code = 2});
    EXPECT_EQ(few.findings.size(), 2U);
    EXPECT_EQ(few.total, all.total);
    EXPECT_EQ(few.totals, all.totals);
    const ValidationReport none = validate(file, {.threads = 1, .max_findings = 0});
    EXPECT_TRUE(none.findings.empty());
    EXPECT_EQ(none.total, all.total);
    EXPECT_EQ(none.exit_code, 3);
    EXPECT_FALSE(none.valid());
}

TEST(Validation, UnwantedFindingsDoNotCount) {
    const Bytes file = damaged_chunks();
    const ValidationReport all = validate(file, {.threads = 1});
    ValidateOptions options{.threads = 1};
    options.wanted = [](const CatalogueEntry &entry) { return entry.group() != "hash"; };
    const ValidationReport report = validate(file, options);
    EXPECT_TRUE(report.valid());
    EXPECT_EQ(report.exit_code, 0);
    EXPECT_EQ(report.ignored, all.total);
    EXPECT_EQ(report.total, 0U);
}

TEST(Validation, ChunksAndSectionsAreNamed) {
    for (const Finding &finding : validate(damaged_chunks(), {.threads = 1}).findings) {
        EXPECT_EQ(finding.entry->name, "hash.chunk");
        EXPECT_EQ(finding.section, "level 5 chunks");
        EXPECT_GE(finding.chunk, 0);
        EXPECT_FALSE(finding.expected.empty() || finding.actual.empty());
    }
}

TEST(Validation, MemoryIsBoundedByTheCaller) {
    const Bytes file = value_of(encode_model(test::sphere_model(4, {}), {.threads = 1}));
    const ValidationReport report = validate(file, {.threads = 1, .max_memory = 1000});
    ASSERT_EQ(report.total, 1U);
    EXPECT_EQ(report.findings[0].entry->name, "system.memory");
    EXPECT_EQ(report.exit_code, 4);
    EXPECT_TRUE(validate(file, {.threads = 1, .level = ValidationLevel::quick, .max_memory = 1000}).valid());
}

} // namespace
} // namespace pbm
