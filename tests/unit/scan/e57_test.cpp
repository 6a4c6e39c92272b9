#include "pbm_scan/e57/e57_reader.h"

#include "pbm_scan/e57/crc32c.h"
#include "unit/scan/e57_files.h"
#include "unit/scan/readings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace {

using namespace pbm;
using namespace pbm::test;
using build::Surface;
using E57File = Reading<build::read_e57>;

std::vector<E57Column> cartesian(const std::vector<glm::dvec3> &points) {
    std::vector<E57Column> columns;
    for (const int axis : {0, 1, 2}) {
        std::vector<double> values(points.size());
        for (std::size_t i = 0; i < values.size(); ++i)
            values[i] = points[i][axis];
        columns.push_back(e57_floats(std::string("cartesian") + "XYZ"[axis], values));
    }
    return columns;
}

E57ScanText scan_of(const std::vector<glm::dvec3> &points, std::vector<E57Column> others = {}) {
    E57ScanText scan{.columns = cartesian(points)};
    scan.columns.insert(scan.columns.end(), others.begin(), others.end());
    return scan;
}

const std::vector<glm::dvec3> kFour{{1, 2, 3}, {-4, 5.5, 1e-9}, {1e7 + 0.001, 0, 0}, {0, 0, -1}};

std::string pose(const std::string &rotation, const std::string &translation) {
    return R"(<pose type="Structure"><rotation type="Structure">)" + rotation +
           R"(</rotation><translation type="Structure">)" + translation + "</translation></pose>";
}
// A quarter turn about z.
const std::string kQuarter = "<w type=\"Float\">0.70710678118654757</w><x/><y/><z>7.0710678118654757e-001</z>";

TEST(Crc32c, IsThatOfTheStandard) {
    EXPECT_EQ(build::crc32c(bytes_of("123456789")), 0xE3069283U); // the check value of every catalogue of CRCs
    EXPECT_EQ(build::crc32c(bytes_of(std::string(32, '\0'))), 0x8A9136AAU); // RFC 3720, B.4
    EXPECT_EQ(build::crc32c({}), 0U);
}

TEST(E57, PointsAreReadInDoublePrecision) {
    const Surface s = E57File::surface(e57_file({scan_of(kFour)}));
    EXPECT_EQ(s.positions, kFour);
    EXPECT_TRUE(s.colours.empty() && s.normals.empty() && s.triangles.empty() && s.stations.empty());
    EXPECT_EQ(report_of(s, "cartesianX cartesianY cartesianZ").fate, Fate::kept);
}

TEST(E57, ZerosAtTheScannerAreLeftOutBeforeThePoseMovesThem) {
    std::vector<glm::dvec3> points;
    for (int i = 0; i < 100; ++i)
        points.insert(points.end(), {glm::dvec3(i - 50, i % 7 - 3, 1 + i % 3), glm::dvec3(0)});
    E57ScanText scan = scan_of(points);
    scan.more = pose("<w>1</w><x/><y/><z/>", "<x>100</x><y>200</y><z>1.7</z>");
    const Surface s = E57File::surface(e57_file({scan}));
    EXPECT_EQ(s.positions.size(), 100U);
    EXPECT_EQ(s.positions[0], glm::dvec3(50, 197, 2.7));
    EXPECT_TRUE(has(report(s, "placeholders").note, "100 points at 0 0 0"));
}

TEST(E57, FloatsOfSinglePrecisionAreRead) {
    E57ScanText scan;
    for (const char *name : {"cartesianX", "cartesianY", "cartesianZ"})
        scan.columns.push_back(e57_floats(name, std::vector<float>{0.1F, -2.0F}));
    EXPECT_EQ(E57File::surface(e57_file({scan})).positions,
              (std::vector{glm::dvec3(static_cast<double>(0.1F)), glm::dvec3(-2.0)}));
}

// Streams are cut at every byte, so that values span packets.
TEST(E57, IntegersOfEveryWidthSpanPackets) {
    std::mt19937_64 random(1);
    constexpr std::size_t kPoints = 1500; // more than are decoded at a time
    for (int bits = 0; bits <= 64; ++bits) {
        const std::uint64_t most = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
        const auto minimum = bits == 64 ? std::numeric_limits<std::int64_t>::min() : std::int64_t{-5};
        const auto maximum = static_cast<std::int64_t>(static_cast<std::uint64_t>(minimum) + most);
        std::vector<std::int64_t> values;
        for (std::size_t i = 0; i < kPoints; ++i)
            values.push_back(static_cast<std::int64_t>(static_cast<std::uint64_t>(minimum) + (random() & most)));
        E57ScanText scan{.columns = {}, .stream_bytes = 1 + static_cast<std::size_t>(bits) % 60, .other_packets = true};
        scan.columns.push_back(e57_integers("cartesianX", minimum, maximum, values));
        scan.columns.push_back(e57_floats("cartesianY", std::vector<double>(kPoints, 1.5)));
        scan.columns.push_back(e57_integers("cartesianZ", minimum, maximum, values, R"(scale="0.125" offset="-7")"));
        const Surface s = E57File::surface(e57_file({scan}));
        ASSERT_EQ(s.positions.size(), kPoints) << bits;
        for (std::size_t i = 0; i < kPoints; ++i) {
            const auto value = static_cast<double>(values[i]);
            ASSERT_EQ(s.positions[i], glm::dvec3(value, 1.5, value * 0.125 - 7)) << bits << " " << i;
        }
    }
}

TEST(E57, FieldsInAnyOrderAndOfNoUseAreSkipped) {
    E57ScanText scan = scan_of(
        kFour, {e57_integers("timeStamp", 0, 1000, {1, 2, 3, 1000}), e57_integers("acme:rain", -1, 1, {0, 1, -1, 0})});
    std::reverse(scan.columns.begin(), scan.columns.end());
    E57Column text{.element = R"(<acme:remark type="String"/>)", .stream = "\2a\2b\2c\2d", .records = 4};
    scan.columns.insert(scan.columns.begin() + 1, text);
    const Surface s = E57File::surface(e57_file({scan}, "", "xmlns:acme=\"http://acme\""));
    EXPECT_EQ(s.positions, kFour);
    EXPECT_TRUE(has(report_of(s, "timeStamp").note, "a measurement that is not shown"));
    EXPECT_TRUE(has(report_of(s, "acme:rain").note, "an extension that PBM does not know"));
    EXPECT_EQ(report_of(s, "extension 'acme'").fate, Fate::dropped);
}

TEST(E57, FieldsOfNoUseCanBeKept) {
    const E57ScanText scan = scan_of(kFour, {e57_integers("timeStamp", 0, 1000, {1, 2, 3, 1000}),
                                             e57_integers("acme:rain", -1, 1, {0, 1, -1, 0}),
                                             e57_integers("intensity", 5, 5, {5, 5, 5, 5})});
    const std::string file = e57_file({scan}, "", "xmlns:acme=\"http://acme\"");
    const Result<Surface> s = build::read_e57(bytes_of(file), {.fields = {"timestamp", "rain", "intensity"}});
    ASSERT_TRUE(s) << s.error().message;
    EXPECT_EQ(s->positions, kFour); // nothing else is touched
    const auto values = [&](std::size_t slot) {
        std::vector<double> all;
        for (const build::FieldValue &value : s->field_values[slot])
            all.push_back(value.number);
        return all;
    };
    EXPECT_EQ(values(0), (std::vector<double>{1, 2, 3, 1000}));
    EXPECT_EQ(values(1), (std::vector<double>{0, 1, -1, 0}));
    EXPECT_EQ(values(2), (std::vector<double>{5, 5, 5, 5}));
    EXPECT_EQ(report_of(*s, "acme:rain").fate, Fate::kept);
}

TEST(E57, PosesMoveScansAndSayWhereTheScannerStood) {
    E57ScanText turned =
        scan_of({{1, 0, 5}, {2, 0, 5}, {2, 3, 5}}, {e57_floats("nor:normalX", std::vector{1.0F, 0.F, 0.F}),
                                                    e57_floats("nor:normalY", std::vector{0.F, 1.0F, 0.F}),
                                                    e57_floats("nor:normalZ", std::vector{0.F, 0.F, 0.F})});
    turned.more = pose(kQuarter, "<x>10</x><y type=\"Float\">20</y><z>30</z>");
    E57ScanText still = scan_of({{7, 8, 9}, {8, 8, 9}});
    const Surface s = E57File::surface(e57_file({still, turned}));
    ASSERT_EQ(s.positions.size(), 5U);
    EXPECT_EQ(s.positions[0], glm::dvec3(7, 8, 9)); // exactly
    const auto is_near = [](const glm::dvec3 &a, const glm::dvec3 &b) {
        return std::abs(a.x - b.x) + std::abs(a.y - b.y) + std::abs(a.z - b.z) < 1e-12;
    };
    EXPECT_TRUE(is_near(s.positions[2], {10, 21, 35}));
    EXPECT_TRUE(is_near(s.positions[4], {7, 22, 35}));
    ASSERT_EQ(s.normals.size(), 5U);
    EXPECT_EQ(s.normals[0], glm::vec3(0)); // the scan has none
    EXPECT_NEAR(s.normals[2].y, 1, 1e-6);
    EXPECT_NEAR(s.normals[3].x, -1, 1e-6);
    EXPECT_EQ(s.stations, (std::vector<glm::dvec3>{{10, 20, 30}}));
    EXPECT_EQ(s.station_ids, (std::vector<std::uint16_t>{build::kNoStation, build::kNoStation, 0, 0, 0}));
    EXPECT_TRUE(has(report_of(s, "nor:normalX").note, "1 have no length"));
    EXPECT_TRUE(has(report_of(s, "data3D").note, "2 scans, 1 moved"));
    EXPECT_TRUE(has(report_of(s, "scanner positions").note, "1 of 2"));
}

TEST(E57, PosesThatOnlyShiftAreThoseOfAMap) {
    E57ScanText shifted = scan_of({{7, 8, 9}, {8, 8, 9}}), turned = scan_of({{1, 0, 5}, {2, 0, 5}});
    shifted.more = pose("<w>1</w>", "<x>100</x>");
    turned.more = pose(kQuarter, "<x>3</x>");
    const Surface alone = E57File::surface(e57_file({shifted}));
    EXPECT_EQ(alone.positions[0], glm::dvec3(107, 8, 9));
    EXPECT_TRUE(alone.stations.empty());
    const Surface both = E57File::surface(e57_file({shifted, turned}));
    EXPECT_EQ(both.stations, (std::vector<glm::dvec3>{{100, 0, 0}, {3, 0, 0}}));
}

TEST(E57, AScannerFarFromItsPointsIsNone) {
    E57ScanText scan = scan_of({{0, 0, 0}, {1, 1, 0}});
    scan.more = pose(kQuarter, "<x>100</x>");
    EXPECT_EQ(E57File::surface(e57_file({scan})).stations.size(), 1U); // it moves with its points
    const double pi = std::acos(-1.0);
    const E57ScanText far{.columns = {e57_floats("sphericalRange", std::vector{1e6, 1e6 + 1}),
                                      e57_floats("sphericalAzimuth", std::vector{pi / 2, pi / 2}),
                                      e57_floats("sphericalElevation", std::vector{0.0, 0.0})}};
    EXPECT_TRUE(E57File::surface(e57_file({far})).stations.empty());
}

TEST(E57, SphericalCoordinatesBecomePositions) {
    const double pi = std::acos(-1.0);
    const E57ScanText scan{.columns = {e57_floats("sphericalRange", std::vector{2.0, 2.0, 3.0, 5.0}),
                                       e57_floats("sphericalAzimuth", std::vector{0.0, pi / 2, -pi, 1.0}),
                                       e57_floats("sphericalElevation", std::vector{0.0, pi / 6, 0.0, 0.5}),
                                       e57_integers("sphericalInvalidState", 0, 2, {0, 0, 2, 1})}};
    const Surface s = E57File::surface(e57_file({scan}));
    ASSERT_EQ(s.positions.size(), 2U);
    EXPECT_EQ(s.positions[0], glm::dvec3(2, 0, 0));
    EXPECT_NEAR(s.positions[1].y, std::sqrt(3.0), 1e-12);
    EXPECT_NEAR(s.positions[1].z, 1, 1e-12);
    EXPECT_EQ(s.stations, std::vector<glm::dvec3>{glm::dvec3(0)});
    EXPECT_TRUE(has(report_of(s, "sphericalInvalidState").note,
                    "1 point with a direction only and 1 point without a position left out"));
}

TEST(E57, InvalidPointsAreLeftOutWithTheirAttributes) {
    const Surface s = E57File::surface(e57_file({scan_of(
        kFour, {e57_floats("cartesianInvalidState", std::vector{0.F, 1.F, 2.F, 0.F}),
                e57_integers("colorRed", 0, 255, {1, 2, 3, 4}), e57_integers("colorGreen", 0, 255, {5, 6, 7, 8}),
                e57_integers("colorBlue", 0, 255, {9, 10, 11, 255})})}));
    EXPECT_EQ(s.positions, (std::vector{kFour[0], kFour[3]}));
    EXPECT_EQ(s.colours, (std::vector{Rgb8{1, 5, 9}, Rgb8{4, 8, 255}}));
    EXPECT_EQ(report_of(s, "colorRed").fate, Fate::kept);
    EXPECT_TRUE(has(
        E57File::error(e57_file({scan_of(kFour, {e57_integers("cartesianInvalidState", 0, 2, {1, 1, 2, 2})})})).message,
        "none of the 4 points has a position"));
}

TEST(E57, ColoursAreScaledByTheirLimits) {
    E57ScanText scan = scan_of(kFour, {e57_integers("colorRed", 0, 65535, {0, 65535, 257, 32768}),
                                       e57_integers("colorGreen", 0, 1023, {0, 1023, 512, 100}),
                                       e57_floats("colorBlue", std::vector{0.0F, 1.0F, 0.5F, 7.0F}),
                                       e57_integers("isColorInvalid", 0, 1, {0, 0, 0, 1})});
    scan.more = R"(<colorLimits type="Structure"><colorGreenMinimum type="Integer"/>)"
                R"(<colorGreenMaximum type="Integer">512</colorGreenMaximum></colorLimits>)";
    const Surface s = E57File::surface(e57_file({scan, scan_of({{0, 0, 0}})}));
    const Rgb8 other = Material{}.colour;
    EXPECT_EQ(s.colours, (std::vector{Rgb8{0, 0, 0}, Rgb8{255, 255, 255}, Rgb8{1, 255, 128}, other, other}));
    EXPECT_EQ(report_of(s, "colorRed colorGreen").fate, Fate::converted);
    EXPECT_EQ(report_of(s, "colorBlue").note,
              "sRGB, from 0..1 to 8 bits: the file has no limits of them; 1 colour outside clamped");
    EXPECT_TRUE(has(report_of(s, "isColorInvalid").note, "1 point without a colour"));
}

TEST(E57, ColoursWithoutLimitsHaveTheRangeOfNearlyAll) {
    const auto floats = [](const std::vector<float> &red, const std::vector<float> &green,
                           const std::vector<float> &blue) {
        return scan_of(kFour,
                       {e57_floats("colorRed", red), e57_floats("colorGreen", green), e57_floats("colorBlue", blue)});
    };
    const Surface bytes = E57File::surface(e57_file({floats({200, 0, 1, 255}, {100, 0, 2, 255}, {30, 0, 3.6F, 255})}));
    EXPECT_EQ(bytes.colours, (std::vector{Rgb8{200, 100, 30}, Rgb8{0, 0, 0}, Rgb8{1, 2, 4}, Rgb8{255, 255, 255}}));
    EXPECT_EQ(report_of(bytes, "colorRed colorGreen colorBlue").note,
              "sRGB, from 0..255 to 8 bits: the file has no limits of them");
    const Surface parts = E57File::surface(e57_file({floats({0.5, 0, 1, 0}, {0, 0, 1, 0}, {0, 0, 1, 0.2F})}));
    EXPECT_EQ(parts.colours, (std::vector{Rgb8{128, 0, 0}, Rgb8{0, 0, 0}, Rgb8{255, 255, 255}, Rgb8{0, 0, 51}}));

    constexpr auto kLowest = std::numeric_limits<std::int64_t>::min(),
                   kHighest = std::numeric_limits<std::int64_t>::max();
    const auto whole = [&](const char *name, const std::vector<std::int64_t> &values) {
        return e57_integers(name, kLowest, kHighest, values);
    };
    const Surface integers = E57File::surface(
        e57_file({scan_of(kFour, {whole("colorRed", {200, 0, 1, 255}), whole("colorGreen", {100, 0, 2, 255}),
                                  e57_integers("colorBlue", 0, 255, {30, 0, 3, 255})})}));
    EXPECT_EQ(integers.colours, (std::vector{Rgb8{200, 100, 30}, Rgb8{0, 0, 0}, Rgb8{1, 2, 3}, Rgb8{255, 255, 255}}));
    const Surface none = E57File::surface(e57_file({floats({1e6, 2e6, 3e6, 4e6}, {1, 1, 1, 1}, {1, 1, 1, 1})}));
    EXPECT_EQ(none.colours.front(), Material{}.colour);
    EXPECT_EQ(report_of(none, "colorRed").fate, Fate::dropped);
}

TEST(E57, IntensityIsGreyWhereNothingHasColours) {
    const E57Column intensity = e57_floats("intensity", std::vector{-100.0F, 0.0F, 50.0F, 100.0F});
    const Surface s = E57File::surface(e57_file({scan_of(kFour, {intensity})}));
    EXPECT_EQ(s.colours, (std::vector{Rgb8{0, 0, 0}, Rgb8{128, 128, 128}, Rgb8{255, 255, 255}, Rgb8{255, 255, 255}}));
    EXPECT_EQ(report_of(s, "intensity").fate, Fate::converted);
    const std::vector<std::int64_t> one(4, 1);
    const Surface coloured = E57File::surface(
        e57_file({scan_of(kFour, {intensity, e57_integers("colorRed", 0, 1, one), e57_integers("colorGreen", 0, 1, one),
                                  e57_integers("colorBlue", 0, 1, one)})}));
    EXPECT_EQ(coloured.colours.front(), (Rgb8{255, 255, 255}));
    EXPECT_EQ(report_of(coloured, "intensity").fate, Fate::dropped);
}

// 8 rows and 10 columns of a wall 5 away; `shifted`: the scanner's place.
E57ScanText wall(const glm::dvec3 &shifted) {
    std::vector<glm::dvec3> points;
    std::vector<std::int64_t> rows, columns;
    for (int row = 0; row < 8; ++row)
        for (int column = 0; column < 10; ++column) {
            points.emplace_back(0.1 * column - 0.5, 5, 0.1 * row - 0.4);
            rows.push_back(100 + row);
            columns.push_back(column);
        }
    E57ScanText scan =
        scan_of(points, {e57_integers("rowIndex", 0, 1000, rows), e57_integers("columnIndex", 0, 9, columns)});
    scan.more = pose("<w>1</w>", "<x>" + std::to_string(shifted.x) + "</x>");
    return scan;
}

TEST(E57, RowsAndColumnsBecomeTrianglesThatFaceTheScanner) {
    const Surface s = E57File::surface(e57_file({wall({0, 0, 0}), wall({3, 0, 0})}));
    EXPECT_EQ(s.triangles.size(), 2U * 2 * 7 * 9);
    EXPECT_EQ(s.stations, (std::vector<glm::dvec3>{{0, 0, 0}, {3, 0, 0}}));
    for (const glm::uvec3 &t : s.triangles) {
        const glm::dvec3 u = s.positions[t.y] - s.positions[t.x], v = s.positions[t.z] - s.positions[t.x];
        EXPECT_LT(u.z * v.x - u.x * v.z, 0); // the normal's y: towards the scanner
    }
    EXPECT_EQ(report_of(s, "rowIndex").fate, Fate::converted);
}

TEST(E57, ScansWithoutAWholeGridStayPoints) {
    const Surface other = E57File::surface(e57_file({wall({0, 0, 0}), scan_of(kFour)}));
    EXPECT_TRUE(other.triangles.empty());
    EXPECT_TRUE(has(report_of(other, "rowIndex").note, "kept as points"));
    E57ScanText twice =
        scan_of(kFour, {e57_integers("rowIndex", 0, 9, {0, 0, 1, 1}), e57_integers("columnIndex", 0, 9, {0, 1, 1, 1})});
    EXPECT_TRUE(E57File::surface(e57_file({twice})).triangles.empty());
    E57ScanText sparse = scan_of(kFour, {e57_integers("rowIndex", 0, 1 << 30, {0, 0, 1, 1 << 30}),
                                         e57_integers("columnIndex", 0, 1 << 30, {0, 1, 1, 1 << 30})});
    EXPECT_TRUE(E57File::surface(e57_file({sparse})).triangles.empty());
}

TEST(E57, WhatIsNotUsedIsNamed) {
    E57ScanText scan = scan_of(kFour);
    scan.more = R"(<pointGroupingSchemes type="Structure"/>)";
    const Surface s = E57File::surface(e57_file(
        {scan}, R"(<images2D type="Vector"><vectorChild type="Structure"/><vectorChild type="Structure"/>)"
                R"(</images2D><coordinateMetadata type="String"><![CDATA[ PROJCS["a"] ]]></coordinateMetadata>)"));
    EXPECT_TRUE(has(report_of(s, "images2D").note, "2 images"));
    EXPECT_EQ(report_of(s, "pointGroupingSchemes").fate, Fate::dropped);
    EXPECT_EQ(s.crs, "PROJCS[\"a\"]");
    EXPECT_TRUE(has(E57File::error(e57_file({scan}), {.strict = true, .progress = {}}).message,
                    "--strict: pointGroupingSchemes"));
    const Surface more = E57File::surface(e57_file({scan_of(kFour)}) + "tail");
    EXPECT_TRUE(has(report_of(more, "end of file").note, "4 bytes"));
    const auto crs_of = [](const std::string &text) {
        return E57File::surface(e57_file({scan_of(kFour)}, "<coordinateMetadata>" + text + "</coordinateMetadata>"))
            .crs;
    };
    EXPECT_EQ(crs_of(std::string(70000, 'x')), std::string(65536, 'x'));
    EXPECT_EQ(crs_of(std::string(65535, 'x') + "\xc3\xa4y"), std::string(65535, 'x')); // no half character
}

std::string small_file() {
    return e57_file({scan_of(kFour, {e57_integers("cartesianInvalidState", 0, 2, {0, 1, 0, 0})})});
}

TEST(E57, EveryChangedByteIsRefused) {
    const std::string good = small_file();
    for (std::size_t at = 8; at < good.size(); ++at) {
        std::string bad = good;
        bad[at] = static_cast<char>(bad[at] ^ 1 << at % 8);
        const Result<Surface> result = build::read_e57(bytes_of(bad), {});
        ASSERT_FALSE(result.ok()) << at;
        ASSERT_TRUE(at < 48 || has(result.error().message, "page " + std::to_string(at / kE57Page))) << at;
    }
}

TEST(E57, EveryTruncationIsRefused) {
    const std::string good = small_file();
    for (std::size_t size = 0; size < good.size(); ++size)
        ASSERT_FALSE(build::read_e57(bytes_of(good.substr(0, size)), {}).ok()) << size;
}

// A file in which `from` is `to`, with valid checksums.
std::string edited(const std::string &file, std::string_view from, std::string_view to) {
    std::string logical;
    for (std::size_t at = 0; at < file.size(); at += kE57Page)
        logical += file.substr(at, kE57Payload);
    EXPECT_EQ(from.size(), to.size());
    const std::size_t at = logical.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return e57_pages(logical.replace(at, from.size(), to));
}

TEST(E57, DamagedPacketsAreRefused) {
    const std::string good = small_file();
    // A packet of 6 + 2 x 4 bytes and streams of 32, 32, 32 and 1 bytes: 111, and 1 of padding.
    const std::string packet = std::string("\1\0\x6f\0\4\0\x20\0\x20\0\x20\0\1\0", 14);
    EXPECT_EQ(E57File::surface(edited(good, packet, packet)).positions.size(), 3U);
    const auto refused = [&](std::string_view as) { return E57File::error(edited(good, packet, as)).message; };
    EXPECT_TRUE(has(refused(std::string_view("\3\0\x6f\0\4\0\x20\0\x20\0\x20\0\1\0", 14)), "unknown type 3"));
    EXPECT_TRUE(
        has(refused(std::string_view("\2\0\x6f\0\4\0\x20\0\x20\0\x20\0\1\0", 14)), "the packets end after 0 of 4"));
    EXPECT_TRUE(
        has(refused(std::string_view("\1\0\x6e\0\4\0\x20\0\x20\0\x20\0\1\0", 14)), "a packet says that it has 111"));
    EXPECT_TRUE(has(refused(std::string_view("\1\0\xff\xff\4\0\x20\0\x20\0\x20\0\1\0", 14)),
                    "a packet says that it has 65536"));
    EXPECT_TRUE(has(refused(std::string_view("\1\0\x6f\0\3\0\x20\0\x20\0\x20\0\1\0", 14)), "3 byte streams"));
    EXPECT_TRUE(has(refused(std::string_view("\1\0\x6f\0\4\0\x20\0\x20\0\xff\0\1\0", 14)), "longer than the packet"));
    EXPECT_TRUE(has(refused(std::string_view("\1\0\x6f\0\4\0\x20\0\x18\0\x20\0\1\0", 14)),
                    "the packets end after 3 of 4 values of cartesianY"));
}

TEST(E57, PointsBeyondTheCountAreNamed) {
    const Surface s = E57File::surface(edited(e57_file({scan_of(kFour)}), "recordCount=\"4\">", "recordCount=\"2\">"));
    EXPECT_EQ(s.positions.size(), 2U);
    EXPECT_TRUE(has(report_of(s, "scan 1").note, "points beyond the 2"));
}

TEST(E57, CountsBeyondTheFileAreRefused) {
    const std::string good = small_file();
    EXPECT_TRUE(
        has(E57File::error(edited(good, "recordCount=\"4\">", "recordCount=\"9\">")).message, "the packets end"));
    E57ScanText scan = scan_of(kFour);
    scan.columns[0].records = std::uint64_t{1} << 40;
    EXPECT_TRUE(has(E57File::error(e57_file({scan})).message, "the limit is 2^32 - 2"));
    scan.columns[0].records = 4000000000;
    EXPECT_TRUE(has(E57File::error(e57_file({scan})).message, "the file has room for"));
    std::vector<E57ScanText> many(20, scan_of(kFour));
    for (E57ScanText &each : many) // together they have more points than bytes
        each.columns[0].records = 80;
    EXPECT_TRUE(has(E57File::error(e57_file(many)).message, "the file has room for"));
}

TEST(E57, DamagedDescriptionsAreRefused) {
    const std::string good = e57_file({scan_of(kFour)});
    EXPECT_TRUE(has(E57File::error(edited(good, "</e57Root>", "</e57Toot>")).message, "mismatched tag in its line 1"));
    EXPECT_TRUE(has(E57File::error(edited(good, "</e57Root>", "<e57Root/>")).message, "the XML section is damaged"));
    EXPECT_TRUE(has(E57File::error(edited(good, "data3D type=\"Vector\"", "data3D type=\"Ve&a;r\"")).message,
                    "undefined entity"));
    EXPECT_TRUE(
        has(E57File::error(edited(good, "cartesianZ", "cartesianQ")).message, "scan 1: its points have neither"));
    EXPECT_TRUE(has(E57File::error(edited(good, "\"double\"", "\"triple\"")).message, "neither single nor double"));
    EXPECT_TRUE(has(E57File::error(edited(good, "cartesianY", "cartesianX")).message, "have this field twice"));
    EXPECT_TRUE(has(E57File::error(edited(good, "fileOffset=\"48\"", "fileOffset=\"52\"")).message,
                    "there is no section of points"));
    EXPECT_TRUE(
        has(E57File::error(edited(good, "fileOffset=\"48\"", "fileOffset=\"-1\"")).message, "which is not a number"));
    E57ScanText scan = scan_of(kFour);
    scan.more = pose("<w>5</w>", "<x/>");
    EXPECT_TRUE(has(E57File::error(e57_file({scan})).message, "no unit quaternion"));
    scan.more = pose("<w>1</w>", "<x>one</x>");
    EXPECT_TRUE(has(E57File::error(e57_file({scan})).message, "x is 'one', which is not a number"));
    scan = scan_of(kFour, {e57_integers("rowIndex", 5, 4, {4, 4, 4, 4})});
    EXPECT_TRUE(has(E57File::error(e57_file({scan})).message, "its minimum is above its maximum"));
    EXPECT_TRUE(has(E57File::error(e57_around("", R"(<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>)")).message, "DOCTYPE"));
    std::string deep;
    for (int i = 0; i < 100; ++i)
        deep += "<a>";
    EXPECT_EQ(E57File::error(e57_around("", deep)).code, ErrorCode::too_large);
    EXPECT_TRUE(has(E57File::error(e57_around("", "<other/>")).message, "does not begin with e57Root"));
    EXPECT_TRUE(has(E57File::error(e57_file({})).message, "no points"));
    EXPECT_TRUE(
        has(E57File::error(e57_file({}, R"(<images2D><vectorChild/></images2D>)")).message, "images, but no scans"));
}

TEST(E57, OtherVersionsAndCompressionsAreNotSupported) {
    E57ScanText scan = scan_of(kFour);
    scan.codecs = R"(<vectorChild><inputs/><bitPackCodec/></vectorChild>)";
    EXPECT_EQ(E57File::surface(e57_file({scan})).positions, kFour);
    scan.codecs = R"(<vectorChild><inputs/><acme:wavelet/></vectorChild>)";
    const Error codec = E57File::error(e57_file({scan}));
    EXPECT_EQ(codec.code, ErrorCode::unsupported_feature);
    EXPECT_TRUE(has(codec.message, "'acme:wavelet'"));
    const Error version =
        E57File::error(edited(small_file(), std::string_view("ASTM-E57\1", 9), std::string_view("ASTM-E57\2", 9)));
    EXPECT_EQ(version.code, ErrorCode::unsupported_feature);
}

TEST(E57, ProgressGrows) {
    E57ScanText scan = scan_of(std::vector<glm::dvec3>(20000, glm::dvec3(1)));
    double last = 0;
    build::ReadOptions options;
    options.progress = [&](double done) {
        EXPECT_TRUE(done >= last && done <= 1);
        last = done;
    };
    EXPECT_TRUE(build::read_e57(bytes_of(e57_file({scan, scan})), options).ok());
    EXPECT_GT(last, 0.9);
}

} // namespace
