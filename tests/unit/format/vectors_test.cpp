// The files of format_spec/vectors: every valid one reads, every bad one is refused by the rule in its name.
#include "system/files/mapped_file.h"
#include "unit/support/file_damage.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>

namespace pbm {
namespace {

const std::filesystem::path kVectors = PBM_SOURCE_DIR "/format_spec/vectors";

struct Expected {
    std::string code, rule, kind, message;
    std::uint64_t offset = 0;
};

// file,code,rule,kind,offset,"message"
std::map<std::string, Expected> read_table(const char *folder) {
    std::ifstream in(kVectors / folder / "table.csv");
    std::map<std::string, Expected> table;
    std::string line, file, offset;
    std::getline(in, line);
    while (std::getline(in, line)) {
        std::istringstream row(line);
        Expected expected;
        for (std::string *field : {&file, &expected.code, &expected.rule, &expected.kind, &offset})
            std::getline(row, *field, ',');
        std::getline(row, expected.message);
        expected.message = expected.message.substr(1, expected.message.size() - 2);
        expected.offset = std::stoull(offset);
        table[file] = expected;
    }
    return table;
}

void expect_finding(const std::string &name, const Finding &finding, const Expected &expected) {
    EXPECT_EQ(finding.entry->name, expected.code) << name;
    EXPECT_EQ(finding.rule, expected.rule) << name;
    EXPECT_EQ(to_string(finding.code), expected.kind) << name;
    EXPECT_EQ(finding.offset, expected.offset) << name;
    EXPECT_EQ(finding.message, expected.message) << name;
}

TEST(Vectors, EveryValidFileReadsAndValidates) {
    int files = 0;
    for (const auto &entry : std::filesystem::directory_iterator(kVectors / "valid")) {
        const MappedFile file = value_of(MappedFile::open(entry.path().string()));
        const Status status = test::read_everything(file.bytes());
        EXPECT_TRUE(status) << entry.path() << ": " << status.error().message;
        EXPECT_TRUE(validate(file.bytes(), {.threads = 1}).valid()) << entry.path();
        ++files;
    }
    EXPECT_GE(files, 4);
}

TEST(Vectors, EveryFilterIsInUseInAValidFile) {
    std::set<Filter> used;
    for (const auto &entry : std::filesystem::directory_iterator(kVectors / "valid")) {
        const MappedFile file = value_of(MappedFile::open(entry.path().string()));
        Reader reader = value_of(Reader::open(file.bytes()));
        for (int level = 1; level <= reader.depth(); ++level)
            for (const ChunkEntry &chunk : value_of(reader.directory(level))->chunks)
                for (const StreamEntry &stream : chunk.streams)
                    used.insert(stream.filter);
    }
    EXPECT_EQ(used,
              (std::set<Filter>{Filter::none, Filter::mask_rank, Filter::normal, Filter::radius, Filter::colour565,
                                Filter::colour888, Filter::material, Filter::texture, Filter::shadow}));
}

TEST(Vectors, EveryBadFileIsRefusedByTheRuleInItsNameAtItsPlaceAndByNothingElse) {
    const auto table = read_table("invalid");
    EXPECT_GE(table.size(), 100U);
    for (const auto &[name, expected] : table) {
        const MappedFile file = value_of(MappedFile::open((kVectors / "invalid" / name).string()));
        const ValidationReport report = validate(file.bytes(), {.threads = 1});
        ASSERT_FALSE(report.valid()) << name;
        expect_finding(name, report.findings[0], expected);
        EXPECT_EQ(expected.rule, name.substr(0, name.find('-')));
        for (const Finding &finding : report.findings)
            EXPECT_EQ(finding.entry->name, expected.code) << name << ": " << finding.message;
        EXPECT_EQ(report.exit_code, exit_code(report.findings[0].code)) << name;

        const Status status = test::read_everything(file.bytes());
        ASSERT_FALSE(status) << name;
        EXPECT_EQ(status.error().name, expected.code) << name;
        EXPECT_EQ(status.error().offset, expected.offset) << name;
        EXPECT_EQ(status.error().message, expected.message) << name;
    }
}

TEST(Vectors, LowerLevelsFindWhatTheyRead) {
    for (const auto &[name, expected] : read_table("invalid")) {
        const MappedFile file = value_of(MappedFile::open((kVectors / "invalid" / name).string()));
        const auto report = [&](ValidationLevel level) {
            return validate(file.bytes(), {.threads = 1, .level = level});
        };
        const bool of_the_front =
            expected.rule.starts_with("2.") || expected.rule.starts_with("3.1.") ||
            expected.rule.starts_with("17.1.") || expected.rule.starts_with("18.1.") ||
            expected.rule.starts_with("19.1.") ||
            (expected.rule.starts_with("3.2.") && expected.rule != "3.2.12" && expected.rule != "3.2.14");
        const bool of_the_root = expected.code == "header.root"; // this rule needs the attributes
        EXPECT_EQ(report(ValidationLevel::quick).valid(), !of_the_front || of_the_root) << name;
        const bool of_the_bytes = expected.rule == "3.2.12" || expected.rule == "3.2.14";
        EXPECT_EQ(report(ValidationLevel::hashes).valid(), (!of_the_front || of_the_root) && !of_the_bytes) << name;
        EXPECT_EQ(report(ValidationLevel::standard).valid(),
                  expected.rule == "7.1" || expected.rule == "3.10.14" || expected.rule == "17.3.1")
            << name;
    }
}

TEST(Vectors, EveryOddFileIsValidAndGetsTheAdviceInItsNameAndNoOther) {
    for (const auto &[name, expected] : read_table("advised")) {
        const MappedFile file = value_of(MappedFile::open((kVectors / "advised" / name).string()));
        const ValidationReport report = validate(file.bytes(), {.threads = 1, .least = Severity::info});
        EXPECT_TRUE(report.valid()) << name;
        EXPECT_EQ(report.exit_code, 0) << name;
        ASSERT_FALSE(report.findings.empty()) << name;
        expect_finding(name, report.findings[0], expected);
        EXPECT_TRUE(name == expected.code + ".pbvg" || name.starts_with(expected.code + "-")) << name;
        for (const Finding &finding : report.findings)
            EXPECT_EQ(finding.entry->name, expected.code) << name << ": " << finding.message;
        EXPECT_EQ(validate(file.bytes(), {.threads = 1}).total, 0U) << name;
        EXPECT_TRUE(test::read_everything(file.bytes())) << name;
    }
}

// No file can show errors of the system or of the caller: these codes are listed here.
TEST(Vectors, EveryCodeHasAFile) {
    std::set<std::string, std::less<>> shown{"io.open",       "io.not_a_file", "io.read",
                                             "system.memory", "limit.nodes",   "octree.mask_count"};
    for (const char *folder : {"invalid", "advised"})
        for (const auto &[name, expected] : read_table(folder))
            EXPECT_TRUE(shown.insert(expected.code).second || find_code(expected.code) != nullptr);
    for (const CatalogueEntry &entry : kCatalogue)
        EXPECT_TRUE(shown.contains(entry.name)) << entry.name;
    EXPECT_EQ(shown.size(), kCatalogue.size());
}

TEST(Vectors, EveryFileStandsInItsTable) {
    for (const char *folder : {"invalid", "advised"}) {
        const auto table = read_table(folder);
        for (const auto &entry : std::filesystem::directory_iterator(kVectors / folder)) {
            const std::string name = entry.path().filename().string();
            EXPECT_TRUE(name == "table.csv" || table.contains(name)) << name;
        }
    }
}

} // namespace
} // namespace pbm
