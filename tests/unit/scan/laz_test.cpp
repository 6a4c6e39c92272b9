// LAZ files: those of an encoder of the tests, and damaged ones.
#include "pbm_scan/las/las_records.h"
#include "unit/scan/laz_files.h"
#include "unit/scan/readings.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

// Records that behave like a scan, with outliers and contradictions: all codes and contexts occur.
std::vector<std::string> points(const LazKind &kind, std::size_t count, bool is_plain = false) {
    std::mt19937 random(kind.format + 11 * static_cast<unsigned>(kind.extra) + 100 * kind.version);
    const auto some = [&](unsigned bound) { return static_cast<unsigned>(random() % bound); };
    std::string record(las_record_size(kind.format) + kind.extra, '\0');
    std::array<std::uint64_t, 5> times{};
    for (std::uint64_t &time : times)
        time = random() * 0x100000001ULL;
    std::vector<std::string> all;
    for (std::size_t i = 0; i < count; ++i) {
        const bool is_wild = !is_plain && some(8) == 0;
        for (const std::size_t at : {0U, 4U, 8U})
            put_at<std::uint32_t>(record, at,
                                  is_wild ? static_cast<std::uint32_t>(random() >> some(32))
                                          : field<std::uint32_t>(record, at) + some(5) + (at == 0 ? 30 : 0));
        for (std::size_t at = 12; at < record.size() && !is_plain; ++at)
            if (some(is_wild ? 2 : 12) == 0)
                record[at] = static_cast<char>(some(4) == 0 ? some(256) : byte(record, at) + some(3));
        const std::size_t time_at = kind.format >= 6 ? 22 : 20;
        if (!is_plain && (kind.format >= 6 || has_time11(kind.format))) {
            std::uint64_t &time = times[is_wild ? some(5) : i / 50 % 3];
            time += some(3) == 0 ? 0 : is_wild ? random() : 100 + some(4);
            put_at(record, time_at, time);
        }
        all.push_back(record);
    }
    return all;
}

std::string decoded(const std::string &file) {
    const ByteView bytes = bytes_of(file);
    const Result<LasHeader> header = read_las_header(bytes);
    EXPECT_TRUE(header.ok());
    Result<LasRecords> records = LasRecords::open(bytes, *header, 1);
    if (!records) {
        ADD_FAILURE() << records.error().message;
        return "";
    }
    std::string all;
    for (Result<ByteView> batch = records->next();; batch = records->next()) {
        if (!batch) {
            ADD_FAILURE() << batch.error().message;
            return "";
        }
        if (batch->empty())
            return all;
        all.append(reinterpret_cast<const char *>(batch->data()), batch->size());
    }
}

std::string joined_records(const std::vector<std::string> &records) {
    std::string all;
    for (const std::string &record : records)
        all += record;
    return all;
}

// All kinds of files of a format.
std::vector<LazKind> kinds(unsigned format) {
    std::vector<LazKind> all;
    for (const unsigned version : format >= 6 ? std::vector{3U, 4U} : std::vector{1U, 2U})
        for (const std::size_t extra : {0U, 3U}) {
            all.push_back({.format = format, .version = version, .chunks = {400, 1, 250}, .extra = extra});
            all.push_back(
                {.format = format, .version = version, .chunks = {300, 300, 51}, .are_equal = true, .extra = extra});
        }
    if (format < 6)
        all.push_back({.format = format, .version = 1, .extra = 2});
    return all;
}

TEST(Laz, EveryFormatAndVersionIsTheSameAsLas) {
    for (unsigned format = 0; format <= 10; ++format)
        for (const LazKind &kind : kinds(format)) {
            const auto records = points(kind, 651);
            EXPECT_TRUE(decoded(laz_file(kind, records)) == joined_records(records))
                << "format " << format << " version " << kind.version << " extra " << kind.extra;
        }
}

TEST(Laz, ModelsAreHalvedAndLayersMayBeAbsent) {
    for (const unsigned format : {1U, 6U}) {
        const LazKind kind{.format = format, .version = format == 1 ? 2U : 3U, .chunks = {36000}, .extra = 2};
        for (const bool is_plain : {true, false}) {
            const auto records = points(kind, 36000, is_plain);
            EXPECT_TRUE(decoded(laz_file(kind, records)) == joined_records(records)) << format;
        }
    }
}

// With those that the file withholds.
std::size_t point_count(const Surface &s) {
    const std::string note = note_of(s, "x y z");
    return s.positions.size() + (has(note, "withholds") ? std::stoul(note.substr(note.find(' '))) : 0);
}

std::vector<LazKind> small_kinds() {
    return {{.format = 3, .version = 1, .extra = 1},
            {.format = 5, .version = 2, .chunks = {8, 9}, .extra = 2},
            {.format = 1, .version = 2, .chunks = {6, 6, 5}, .are_equal = true},
            {.format = 0, .version = 2, .chunks = {6, 6, 5}, .are_equal = true, .options = LazKind::kNoTable},
            {.format = 7, .version = 3, .chunks = {9, 8}, .extra = 1},
            {.format = 10, .version = 4, .chunks = {17}, .options = LazKind::kTableAtEnd},
            {.format = 8, .version = 3, .chunks = {12, 5}, .are_equal = true, .options = LazKind::kNoTable}};
}

TEST(Laz, EveryTruncationIsRefused) {
    for (const LazKind &kind : small_kinds()) {
        const std::string file = laz_file(kind, points(kind, 17));
        ASSERT_EQ(point_count(surface(file, "scan")), 17U) << kind.format;
        for (std::size_t size = 4; size < file.size(); ++size)
            EXPECT_FALSE(read(file.substr(0, size), "scan", {.progress = {}, .threads = 1}).ok())
                << "format " << kind.format << " cut at " << size;
    }
}

TEST(Laz, DamagedBytesAreRefusedOrLeaveAllPoints) {
    std::size_t loaded = 0, tried = 0;
    for (const LazKind &kind : small_kinds()) {
        const std::string file = laz_file(kind, points(kind, 17));
        for (std::size_t at = 375; at < file.size(); ++at) {
            std::string damaged = file;
            damaged[at] = static_cast<char>(damaged[at] ^ (1 << at % 8));
            const Result<Surface> result = read(damaged, "scan", {.progress = {}, .threads = 1});
            ++tried;
            if (!result) {
                EXPECT_LE(result.error().offset, file.size());
                EXPECT_FALSE(result.error().message.empty());
                continue;
            }
            ++loaded;
            EXPECT_EQ(point_count(*result), 17U) << "format " << kind.format << " byte " << at;
        }
    }
    EXPECT_LT(loaded, tried / 2); // the first point of each chunk and some numbers of the writer may be anything
}

TEST(Laz, ThreadsDoNotChangeTheResult) {
    const LazKind kind{.format = 7, .version = 3, .chunks = std::vector<unsigned>(40, 50)};
    const std::string file = laz_file(kind, points(kind, 2000));
    const Result<Surface> one = read(file, "scan", {.progress = {}, .threads = 1}),
                          four = read(file, "scan", {.progress = {}, .threads = 4});
    ASSERT_TRUE(one.ok() && four.ok());
    EXPECT_EQ(one->positions, four->positions);
    EXPECT_EQ(one->colours, four->colours);
}

TEST(Laz, AnnouncedPointsAreComparedWithWhatIsThere) {
    const auto announce = [](const LazKind &kind, std::uint32_t count) {
        std::string file = laz_file(kind, points(kind, 17));
        put_at(file, 107, count);
        return file;
    };
    const LazKind unchunked{.format = 1}, equal{.format = 1, .chunks = {9, 8}, .are_equal = true},
        variable{.format = 1, .chunks = {9, 8}}, layered{.format = 6, .version = 3, .chunks = {9, 8}};
    for (const LazKind &kind : {unchunked, equal, variable, layered})
        for (const std::uint32_t count : {18U, 19U, 1000U, 0x7FFFFFFFU, 0xFFFFFFFFU})
            EXPECT_FALSE(read(announce(kind, count), "scan").ok()) << count;
    EXPECT_TRUE(has(error(announce(unchunked, 0x7FFFFFFF), "scan").message, "announces 2147483647 points in"));
    EXPECT_TRUE(has(error(announce(equal, 19), "scan").message, "which are 3 chunks, and has 2"));
    EXPECT_TRUE(has(error(announce(equal, 16), "scan").message, "chunk 1: it is damaged: its points end at byte"));
    EXPECT_TRUE(has(error(announce(variable, 18), "scan").message, "announces 18 points and has 17"));
    for (const LazKind &kind : {variable, layered})
        EXPECT_EQ(note_of(surface(announce(kind, 3), "scan"), "header"), "it announces 3 points; the file has 17");
}

TEST(Laz, TheTableMayBeAtTheEndOrMissing) {
    for (const std::uint32_t options : {LazKind::kTableAtEnd, LazKind::kNoTable})
        for (const LazKind &kind : {LazKind{.format = 3, .chunks = {300, 300, 51}, .are_equal = true},
                                    LazKind{.format = 7, .version = 3, .chunks = {400, 251}}}) {
            LazKind with = kind;
            with.options = options;
            const auto records = points(kind, 651);
            EXPECT_TRUE(decoded(laz_file(with, records)) == joined_records(records)) << kind.format;
        }
    const LazKind variable{.format = 3, .chunks = {9, 8}, .options = LazKind::kNoTable};
    EXPECT_TRUE(has(error(laz_file(variable, points(variable, 17)), "scan").message, "no table of chunks"));
}

TEST(Laz, WhatIsNotKnownIsRefused) {
    const LazKind kind{.format = 1, .chunks = {9, 8}};
    const std::string file = laz_file(kind, points(kind, 17));
    constexpr std::size_t kRecord = 375 + 54;
    const auto changed = [&](std::size_t at, std::uint16_t value) {
        std::string other = file;
        put_at(other, at, value);
        return error(other, "scan");
    };
    EXPECT_EQ(changed(kRecord, 4).code, ErrorCode::unsupported_feature); // compressor
    EXPECT_EQ(changed(kRecord, 0).code, ErrorCode::unsupported_feature);
    EXPECT_TRUE(has(changed(kRecord + 2, 15).message, "LAZ coder 15 is not known"));
    EXPECT_TRUE(has(changed(kRecord + 34 + 4, 6).message, "version 6 of the LAZ item 6 is not known"));
    EXPECT_TRUE(has(changed(kRecord + 34 + 2, 21).message, "describes other points"));
    EXPECT_TRUE(has(changed(kRecord + 32, 1).message, "describes other points"));
    EXPECT_TRUE(has(changed(kRecord, 3).message, "describes other points")); // layers of old points
    EXPECT_TRUE(has(changed(375 + 18, 22205).message, "no whole record 'laszip encoded'"));
    std::string old = file;
    old[104] = static_cast<char>(0xC1);
    EXPECT_TRUE(has(error(old, "scan").message, "before LASzip 1.0"));
}

} // namespace
