// LAS files.
#include "unit/scan/readings.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

template <class T> void put(std::string &file, std::size_t at, T value) {
    std::memcpy(file.data() + at, &value, sizeof value);
}

constexpr std::array<std::size_t, 11> kSizes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
constexpr std::array<std::size_t, 11> kColours{0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};

// Two points of a format: (1, 2, 3) / 100 and (-4, 5, 6) / 100 beyond 500,000; the last with the largest colour.
std::string las(int format, int minor = 4) {
    const std::size_t header = minor >= 4 ? 375 : 227, size = kSizes[static_cast<std::size_t>(format)];
    std::string file(header + 2 * size, '\0');
    file.replace(0, 4, "LASF");
    file[24] = 1;
    file[25] = static_cast<char>(minor);
    put<std::uint16_t>(file, 94, static_cast<std::uint16_t>(header));
    put<std::uint32_t>(file, 96, static_cast<std::uint32_t>(header));
    file[104] = static_cast<char>(format);
    put<std::uint16_t>(file, 105, static_cast<std::uint16_t>(size));
    put<std::uint32_t>(file, 107, 2);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        put<double>(file, 131 + 8 * axis, 0.01);
        put<double>(file, 155 + 8 * axis, 500000);
    }
    const std::array<std::array<std::int32_t, 3>, 2> places{{{1, 2, 3}, {-4, 5, 6}}};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        put<double>(file, 179 + 16 * axis, 500000 + 0.01 * std::max(places[0][axis], places[1][axis]));
        put<double>(file, 187 + 16 * axis, 500000 + 0.01 * std::min(places[0][axis], places[1][axis]));
    }
    for (std::size_t i = 0; i < 2; ++i) {
        const std::size_t at = header + i * size;
        put(file, at, places[i]);
        put<std::uint16_t>(file, at + 12, static_cast<std::uint16_t>(10 + i));
        if (kColours[static_cast<std::size_t>(format)] != 0 && i == 1)
            put<std::array<std::uint16_t, 3>>(file, at + kColours[static_cast<std::size_t>(format)], {65535, 32896, 0});
    }
    return file;
}

Result<Surface> read(const std::string &file) { return test::read(file, "scan"); }
Surface surface(const std::string &file) { return test::surface(file, "scan"); }

// Bytes of the record of LAS 1.4, tables 7 and 16.
TEST(Las, MeasurementsAreFieldsWhereTheyAreAskedFor) {
    for (const int format : {1, 6}) {
        const bool is_new = format == 6;
        std::string file = las(format);
        const std::size_t point = file.size() - kSizes[static_cast<std::size_t>(format)];
        file[point + 14] = static_cast<char>(is_new ? 0x52 : 0x2A); // the second of five returns
        file[point + (is_new ? 16 : 15)] = is_new ? 40 : 2;
        put<std::uint16_t>(file, point + (is_new ? 20 : 18), 77);
        put<double>(file, point + (is_new ? 22 : 20), 1234.5);
        if (is_new)
            put<std::int16_t>(file, point + 18, -1000);
        else
            file[point + 16] = static_cast<char>(-6);
        const ReadOptions options{.fields = {"classification", "return_number", "number_of_returns", "gps_time",
                                             "scan_angle", "point_source", "intensity"}};
        const Result<Surface> s = test::read(file, "scan", options);
        ASSERT_TRUE(s) << s.error().message;
        const std::array<double, 7> expected{is_new ? 40.0 : 2.0, 2, 5, 1234.5, -6, 77, 11};
        for (std::size_t slot = 0; slot < expected.size(); ++slot) {
            ASSERT_EQ(s->field_values[slot].size(), 2U) << slot;
            EXPECT_EQ(s->field_values[slot][1].number, expected[slot]) << format << " " << slot;
        }
        EXPECT_EQ(s->field_units[3], "s");
        EXPECT_EQ(
            note_of(*s,
                    "intensity, return_number, number_of_returns, classification, scan_angle, point_source, gps_time"),
            "fields");
    }
}

TEST(Las, UsualFieldsLieBehindThoseThatAreAskedFor) {
    const ReadOptions options{.fields = {"Classification"},
                              .usual_fields = {"classification", "intensity", "return_number"}};
    const Surface s = value_of(test::read(las(0), "scan", options));
    EXPECT_EQ(s.field_values[0].size(), 2U);
    EXPECT_TRUE(s.field_values[1].empty()); // it is a field already
    ASSERT_EQ(s.field_values[2].size(), 2U);
    EXPECT_EQ(s.field_values[2][1].number, 11);
    EXPECT_EQ(s.field_values[3].size(), 2U);
    EXPECT_TRUE(s.colours.empty());
    EXPECT_EQ(note_of(s, "intensity, return_number, classification"), "fields");
    EXPECT_EQ(surface(las(0)).colours.size(), 2U); // grey, where no field keeps the intensity
}

TEST(Las, EveryPointFormatIsRead) {
    for (int format = 0; format <= 10; ++format) {
        const Surface s = surface(las(format));
        ASSERT_EQ(s.positions.size(), 2U) << format;
        EXPECT_EQ(s.positions[1], glm::dvec3(-4, 5, 6) * glm::dvec3(0.01) + glm::dvec3(500000));
        if (kColours[static_cast<std::size_t>(format)] != 0) {
            EXPECT_EQ(s.colours[1], (Rgb8{255, 128, 0})) << format;
        }
        EXPECT_EQ(note_of(s, "header"), "no such line");
    }
    for (int minor = 0; minor <= 3; ++minor)
        EXPECT_EQ(surface(las(1, minor)).positions.size(), 2U);
}

TEST(Las, WithheldPointsAndWhatIsNotUsedAreNamed) {
    for (const int format : {1, 6}) {
        std::string file = las(format);
        file[375 + 15] = static_cast<char>(format == 1 ? 0x80 : 0x04);
        file[375 + 17] = 7;
        const Surface s = surface(file);
        EXPECT_EQ(s.positions.size(), 1U);
        EXPECT_EQ(note_of(s, "x y z"), "positions; 1 point that the file withholds left out");
        EXPECT_NE(note_of(s, "user_data"), "no such line");
    }
}

TEST(Las, HeadersThatLieAreNamedAndCutFilesRefused) {
    std::string file = las(3);
    put<std::uint32_t>(file, 107, 1);
    EXPECT_EQ(surface(file).positions.size(), 1U); // what lies behind the announced points is none
    EXPECT_EQ(note_of(surface(file), "end of file"), "34 bytes behind the last point");
    put<std::uint32_t>(file, 107, 0);
    EXPECT_EQ(surface(file).positions.size(), 2U);
    EXPECT_EQ(note_of(surface(file), "header"), "it announces 0 points; the file has 2");
    file = las(3);
    put<double>(file, 179, 1e9);
    EXPECT_EQ(note_of(surface(file), "header"), "its bounds are not those of the points");
    file = las(3);
    for (std::size_t size = 4; size < file.size(); ++size)
        EXPECT_FALSE(read(file.substr(0, size)).ok()) << size;
    put<std::uint16_t>(file, 105, 20);
    EXPECT_TRUE(has(read(file).error().message, "points of 20 bytes, their format has 34"));
    EXPECT_TRUE(has(note_of(surface(las(3) + "more"), "end of file"), "4 bytes"));
    file = las(3);
    file[104] = 11;
    EXPECT_TRUE(has(read(file).error().message, "point format 11"));
}

// Puts a variable length record behind the header of 375 bytes.
std::string with_record(std::string file, std::string_view user, int id, const std::string &content) {
    std::string record(54, '\0');
    record.replace(2, user.size(), user);
    put<std::uint16_t>(record, 18, static_cast<std::uint16_t>(id));
    put<std::uint16_t>(record, 20, static_cast<std::uint16_t>(content.size()));
    file.insert(375, record + content);
    put<std::uint32_t>(file, 96, static_cast<std::uint32_t>(375 + record.size() + content.size()));
    put<std::uint32_t>(file, 100, 1);
    return file;
}

// Table 24: two bytes without a meaning, a scaled signed number, two floats of which 7 means that there is none.
TEST(Las, ExtraBytesAreFieldsByTheirNames) {
    std::string whole = las(0), points;
    for (std::size_t i = 0; i < 2; ++i) {
        std::string extra = "ab";
        const auto append = [&](auto value) { extra.append(reinterpret_cast<const char *>(&value), sizeof value); };
        append(static_cast<std::int16_t>(i == 0 ? -300 : 500));
        append(i == 0 ? 1.5F : 7.0F);
        append(i == 0 ? 7.0F : -2.5F);
        points += whole.substr(375 + 20 * i, 20) + extra;
    }
    std::string file = whole.substr(0, 375) + points, described(3 * 192, '\0');
    put<std::uint16_t>(file, 105, 32);
    described[3] = 2; // type 0 has its size in the options
    described[192 + 2] = 4;
    described[192 + 3] = 8 + 16;
    described.replace(192 + 4, 6, "height");
    put<double>(described, 192 + 112, 0.01);
    put<double>(described, 192 + 136, 100);
    described[384 + 2] = 19; // two of type 9
    described[384 + 3] = 1;
    described.replace(384 + 4, 4, "flow");
    put<double>(described, 384 + 40, 7);
    put<double>(described, 384 + 48, 7);
    const std::string las_file = with_record(file, "LASF_Spec", 4, described);
    const Result<Surface> s = test::read(las_file, "scan", {.fields = {"Height", "flow0", "flow1"}});
    ASSERT_TRUE(s) << s.error().message;
    EXPECT_EQ(s->field_values[0][0].number, 97);
    EXPECT_EQ(s->field_values[0][1].number, 105);
    EXPECT_EQ(s->field_values[1][0].number, 1.5);
    EXPECT_TRUE(std::isnan(s->field_values[1][1].number));
    EXPECT_EQ(s->field_values[2][1].number, -2.5);
    EXPECT_TRUE(reports(*s, "extra bytes without a name", Fate::dropped));
    EXPECT_NE(note_of(surface(las_file), "height, flow0, flow1"), "no such line");
    EXPECT_TRUE(reports(surface(file), "extra bytes without a name", Fate::dropped)); // without descriptions
}

TEST(Las, TheCoordinateReferenceSystemIsKept) {
    const std::string wkt = "PROJCS[\"WGS 84 / UTM zone 17N\"]";
    const std::string file = with_record(las(0), "LASF_Projection", 2112, wkt + std::string(1, '\0'));
    EXPECT_EQ(surface(file).crs, wkt);
    EXPECT_EQ(surface(file).convention.up, UpAxis::z);
}

// Behind the points, of any length.
TEST(Las, TheCoordinateReferenceSystemMayBeBehindThePoints) {
    const std::string wkt = "PROJCS[\"" + std::string(5000, 'a') + "\",UNIT[\"foot\",0.3048]]";
    std::string file = las(6), record(60, '\0');
    record.replace(2, 15, "LASF_Projection");
    put<std::uint16_t>(record, 18, 2112);
    put<std::uint64_t>(record, 20, wkt.size());
    put<std::uint64_t>(file, 235, file.size());
    put<std::uint32_t>(file, 243, 1);
    const Surface s = surface(file + record + wkt);
    EXPECT_EQ(s.crs, wkt);
    EXPECT_EQ(s.convention.unit, Unit::foot);
    EXPECT_TRUE(surface(file + record + wkt.substr(1)).crs.empty()); // cut off
    put<std::uint32_t>(file, 243, 0xFFFFFFFF);
    EXPECT_EQ(surface(file + record + wkt).crs, wkt);
}

TEST(Las, GeotiffKeysAndOtherRecordsAreSaid) {
    std::string keys(5 * 8, '\0');
    const std::array<std::uint16_t, 20> values{1, 1,    0,    4, 1024, 0,    1,    1, 3072, 0,
                                               1, 2263, 3076, 0, 1,    9003, 4096, 0, 1,    6360};
    std::memcpy(keys.data(), values.data(), sizeof values);
    const Surface s = surface(with_record(las(1), "LASF_Projection", 34735, keys));
    EXPECT_EQ(s.crs, "EPSG:2263; unit US survey foot (EPSG:9003); heights EPSG:6360");
    EXPECT_EQ(s.convention.unit, Unit::foot);
    EXPECT_TRUE(reports(surface(with_record(las(1), "somebody", 77, "content")), "records somebody 77", Fate::dropped));
}

TEST(Las, AFewBrightColoursDoNotMakeTheOthersBlack) {
    const std::string two = las(2), head = two.substr(0, 375);
    std::string dim = two.substr(375, 26), bright = dim, file = head;
    put<std::array<std::uint16_t, 3>>(dim, 20, {200, 60, 30});
    put<std::array<std::uint16_t, 3>>(bright, 20, {60000, 60, 30});
    file += bright;
    for (int i = 0; i < 200; ++i)
        file += dim;
    put<std::uint32_t>(file, 107, 201);
    const Surface s = surface(file);
    EXPECT_EQ(s.colours[1], (Rgb8{200, 60, 30}));
    EXPECT_EQ(s.colours[0], (Rgb8{255, 60, 30}));
    EXPECT_EQ(note_of(s, "colours"), "sRGB, of 8 bits though the format has 16; 1 colour outside clamped");
}

} // namespace
