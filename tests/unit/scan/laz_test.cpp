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
                record[at] = static_cast<char>(some(4) == 0 ? some(256) : record[at] + some(3));
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
        const LazKind kind{.format = format, .version = format == 1 ? 2U : 3U, .chunks = {60000}, .extra = 2};
        for (const bool is_plain : {true, false}) {
            const auto records = points(kind, 60000, is_plain);
            EXPECT_TRUE(decoded(laz_file(kind, records)) == joined_records(records)) << format;
        }
    }
}

} // namespace
