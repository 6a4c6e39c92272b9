// The files of format_spec/vectors: every valid one reads, every bad one is refused by the rule in its name.
#include "pbm_format/platform.h"
#include "pbm_format/reader.h"
#include "pbm_format/validate.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>

namespace pbm {
namespace {

const std::filesystem::path kVectors = PBM_SOURCE_DIR "/format_spec/vectors";

struct Expected {
    std::string code, message;
    std::uint64_t offset = 0;
};

// file,code,offset,"message"
std::map<std::string, Expected> read_table() {
    std::ifstream in(kVectors / "invalid" / "table.csv");
    std::map<std::string, Expected> table;
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) {
        const std::size_t code = line.find(','), offset = line.find(',', code + 1),
                          message = line.find(',', offset + 1);
        table[line.substr(0, code)] = {.code = line.substr(code + 1, offset - code - 1),
                                       .message = line.substr(message + 2, line.size() - message - 3),
                                       .offset = std::stoull(line.substr(offset + 1))};
    }
    return table;
}

TEST(Vectors, EveryValidFileReadsAndValidates) {
    int files = 0;
    for (const auto &entry : std::filesystem::directory_iterator(kVectors / "valid")) {
        const MappedFile file = MappedFile::open(entry.path().string()).value();
        Result<Reader> reader = Reader::open(file.bytes());
        ASSERT_TRUE(reader) << entry.path() << ": " << reader.error().message;
        const Status status = reader->verify_all(1);
        EXPECT_TRUE(status) << entry.path() << ": " << status.error().message;
        EXPECT_TRUE(validate(file.bytes(), {.threads = 1}).valid()) << entry.path();
        ++files;
    }
    EXPECT_GE(files, 4);
}

TEST(Vectors, EveryFilterIsInUseInAValidFile) {
    std::set<Filter> used;
    for (const auto &entry : std::filesystem::directory_iterator(kVectors / "valid")) {
        const MappedFile file = MappedFile::open(entry.path().string()).value();
        Reader reader = Reader::open(file.bytes()).value();
        for (int level = 1; level <= reader.depth(); ++level)
            for (const ChunkEntry &chunk : reader.directory(level).value()->chunks)
                for (const StreamEntry &stream : chunk.streams)
                    used.insert(stream.filter);
    }
    EXPECT_EQ(used,
              (std::set<Filter>{Filter::none, Filter::mask_rank, Filter::normal, Filter::radius, Filter::colour565,
                                Filter::colour888, Filter::material, Filter::texture, Filter::shadow}));
}

TEST(Vectors, EveryBadFileIsRefusedByTheRuleInItsNameAtItsPlace) {
    const auto table = read_table();
    EXPECT_GE(table.size(), 100U);
    for (const auto &[name, expected] : table) {
        const MappedFile file = MappedFile::open((kVectors / "invalid" / name).string()).value();
        const ValidationReport report = validate(file.bytes(), {.threads = 1});
        ASSERT_FALSE(report.valid()) << name;
        const Finding &first = report.findings[0];
        EXPECT_EQ(to_string(first.code), expected.code) << name;
        EXPECT_EQ(first.offset, expected.offset) << name;
        EXPECT_EQ(first.message, expected.message) << name;
        EXPECT_TRUE(first.message.starts_with(name.substr(0, name.find('-')) + " ")) << name;

        Result<Reader> reader = Reader::open(file.bytes());
        const Status status = reader ? reader->verify_all(1) : Status(reader.error());
        ASSERT_FALSE(status) << name;
        EXPECT_EQ(to_string(status.error().code), expected.code) << name << ": " << status.error().message;
    }
}

TEST(Vectors, EveryBadFileStandsInTheTable) {
    const auto table = read_table();
    for (const auto &entry : std::filesystem::directory_iterator(kVectors / "invalid")) {
        const std::string name = entry.path().filename().string();
        EXPECT_TRUE(name == "table.csv" || table.contains(name)) << name;
    }
}

} // namespace
} // namespace pbm
