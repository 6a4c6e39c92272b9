#include "pbm_scan/ptx/ptx_reader.h"
#include "unit/scan/readings.h"

#include <gtest/gtest.h>

#include <string>

namespace {

using namespace pbm;
using namespace pbm::test;
using build::Surface;
using PtxFile = Reading<build::read_ptx>;

const std::string kAxes = "1 0 0\n0 1 0\n0 0 1\n";
const std::string kStill = "0 0 0\n" + kAxes + "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
// x becomes y, y becomes -x, and the origin 10 20 30.
const std::string kMoved = "10 20 30\n" + kAxes + "0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n";

TEST(Ptx, ScansAreMovedByTheirMatrices) {
    const std::string file = "1\n2\n" + kMoved + "1 0 5 0.5\n0 2 5 0.25\n2\n1\n" + kStill + "1e0 2 3 1\n4 5 6 0\n";
    ASSERT_TRUE(build::is_ptx(bytes_of(file)));
    const Surface s = PtxFile::surface(file);
    EXPECT_EQ(s.positions, (std::vector<glm::dvec3>{{10, 21, 35}, {8, 20, 35}, {1, 2, 3}, {4, 5, 6}}));
    EXPECT_EQ(s.stations, (std::vector<glm::dvec3>{{10, 20, 30}, {0, 0, 0}}));
    EXPECT_EQ(s.station_ids, (std::vector<std::uint16_t>{0, 0, 1, 1}));
    EXPECT_EQ(s.colours.size(), 4U); // grey
    EXPECT_EQ(report_of(s, "intensity").fate, Fate::converted);
    EXPECT_EQ(report_of(s, "scans").note, "2, 1 moved by their matrices");
}

TEST(Ptx, LinesOfSightWithoutAnEchoAreLeftOut) {
    const Surface s =
        PtxFile::surface("1\n3\n" + kMoved + "0 0 0 0.5 0 0 0\r\n1 1 1 0.5 10 20 255\r\n\r\n0 0 0 0.5 0 0 0\r\n");
    EXPECT_EQ(s.positions.size(), 1U);
    EXPECT_EQ(s.colours, (std::vector{Rgb8{10, 20, 255}}));
    EXPECT_TRUE(has(report_of(s, "x y z").note, "2 lines of sight without an echo"));
    EXPECT_EQ(report_of(s, "intensity").fate, Fate::dropped);
    EXPECT_TRUE(has(PtxFile::error("1\n1\n" + kStill + "0 0 0 0.5\n").message, "no points"));
}

// Columns of rows, 0.1 apart at the distance 5; a hole in the middle.
std::string wall(int columns, int rows) {
    std::string text = std::to_string(columns) + "\n" + std::to_string(rows) + "\n" + kMoved;
    for (int column = 0; column < columns; ++column)
        for (int row = 0; row < rows; ++row)
            text += column == 4 && row == 3 ? "0 0 0\n"
                                            : std::to_string(0.1 * column) + " 5 " + std::to_string(0.1 * row) + "\n";
    return text;
}

TEST(Ptx, GridsBecomeTrianglesThatFaceTheScanner) {
    const Surface s = PtxFile::surface(wall(12, 8) + wall(12, 8));
    EXPECT_EQ(s.positions.size(), 2U * (12 * 8 - 1));
    EXPECT_EQ(s.triangles.size(), 2U * (2 * 11 * 7 - 4)); // around the hole four cells have three corners
    for (const glm::uvec3 &t : s.triangles) {
        const glm::dvec3 u = s.positions[t.y] - s.positions[t.x], v = s.positions[t.z] - s.positions[t.x];
        EXPECT_GT(u.y * v.z - u.z * v.y, 0); // the matrix turns the wall's y to -x
    }
    EXPECT_TRUE(s.colours.empty());
    EXPECT_EQ(report_of(s, "rows and columns").fate, Fate::converted);
}

TEST(Ptx, PointsWithoutATriangleStayPointsBesideThem) {
    std::string text = "9\n4\n" + kStill; // the middle column is much farther away
    for (int column = 0; column < 9; ++column)
        for (int row = 0; row < 4; ++row) {
            const double far = column == 4 ? 8 : 1;
            text += std::to_string(far * (0.1 * column - 0.4)) + " " + std::to_string(far * 5) + " " +
                    std::to_string(far * (0.1 * row)) + (column == 4 ? " 1 250 0 0\n" : " 1 0 0 250\n");
        }
    const Surface s = PtxFile::surface(text);
    ASSERT_EQ(s.positions.size(), 36U);
    EXPECT_EQ(s.triangles.size(), 2U * 2 * 3 * 3);
    ASSERT_EQ(s.points_beside_triangles, 4U);
    for (std::size_t i = 0; i < 36; ++i) {
        EXPECT_EQ(s.positions[i].y, i < s.first_point() ? 5 : 40);
        EXPECT_EQ(s.colours[i], i < s.first_point() ? (Rgb8{0, 0, 250}) : (Rgb8{250, 0, 0}));
    }
    EXPECT_TRUE(has(report_of(s, "rows and columns").note, "4 points stay points"));
}

TEST(Ptx, ScansWhoseGridHasNoNeighboursStayPoints) {
    const Surface line = PtxFile::surface("4\n1\n" + kStill + "1 0 0\n1 1 0\n1 2 0\n1 3 0\n");
    EXPECT_TRUE(line.triangles.empty());
    EXPECT_TRUE(has(report_of(line, "rows and columns").note, "kept as points"));
    // The header's place of the scanner cannot be that of points in the coordinates of a map.
    const Surface map =
        PtxFile::surface("2\n2\n" + kStill + "1e6 2e6 5\n1000001 2e6 5\n1e6 2000001 5\n1000001 2000001 5\n");
    EXPECT_TRUE(map.triangles.empty() && map.stations.empty() && map.station_ids.empty());
    EXPECT_EQ(report_of(map, "scanner positions").fate, Fate::dropped);
}

TEST(Ptx, EveryTruncationIsRefusedOrSaysSo) {
    const std::string whole = "2\n2\n" + kMoved + "1 2 3 0.5\n4 5 6 0.5\n0 0 0 0.5\n7 8 9 0.25\n";
    ASSERT_EQ(PtxFile::surface(whole).positions.size(), 3U);
    for (std::size_t size = 0; size < whole.size(); ++size) {
        const Result<Surface> result = build::read_ptx(bytes_of(whole.substr(0, size)), {});
        if (result.ok()) {
            EXPECT_TRUE(has(report_of(*result, "end of file").note, "no line end")) << size;
        }
        EXPECT_EQ(result.ok(), size >= whole.rfind("0.25") + 1) << size;
    }
}

TEST(Ptx, BadLinesAreRefused) {
    const std::string head = "1\n2\n" + kStill;
    EXPECT_TRUE(has(PtxFile::error(head + "1 2 3 0.5\n1 2 x 0.5\n").message, "line 12: 'x' is not a number"));
    EXPECT_TRUE(has(PtxFile::error(head + "1 2 3 0.5\n1 2 3\n").message,
                    "a point of 3 numbers in a scan whose first one has 4"));
    EXPECT_TRUE(has(PtxFile::error(head + "1 2 3 4 5\n1 2 3 4 5\n").message, "are 3, 4 or 7"));
    EXPECT_TRUE(has(PtxFile::error(head + "1 2 3 4 5 6 7 8\n1 2 3 4 5 6 7 8\n").message, "are 3, 4 or 7"));
    EXPECT_TRUE(has(PtxFile::error(head + "1 2 3 0.5\n").message, "has room for 1 points"));
    EXPECT_TRUE(
        has(PtxFile::error(head + "1.0000000 2 3 0.5\n").message, "the file ends after 1 of 2 points of scan 1"));
    EXPECT_TRUE(has(PtxFile::error("4294967295\n1\n" + kStill + "1 2 3\n").message, "must be whole numbers"));
    EXPECT_TRUE(has(PtxFile::error("-1\n1\n" + kStill + "1 2 3\n").message, "must be whole numbers"));
    EXPECT_TRUE(has(PtxFile::error("1\n4294967294\n" + kStill + "1 2 3\n").message, "has room for"));
    EXPECT_TRUE(has(PtxFile::error("1\n1\n0 0 0\n" + kAxes + "1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3\n").message,
                    "the last column of the matrix"));
    EXPECT_TRUE(
        has(PtxFile::error(head + "1 2 3\n4 5 6\n2\n").message, "line 13: the file ends in the header of a scan"));
}

TEST(Ptx, OtherTextsAreNotTaken) {
    EXPECT_FALSE(build::is_ptx(bytes_of("1\n2\n")));
    EXPECT_FALSE(build::is_ptx(bytes_of("1 2 3\n4 5 6\n")));
    EXPECT_FALSE(build::is_ptx(bytes_of("1\n2\n" + kAxes)));
    EXPECT_TRUE(build::is_ptx(bytes_of("1\r\n2\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n0 0 1\r\n1 0 0 0\r\n0 1 0 0\r\n0 0 1 0\r\n"
                                       "0 0 0 1\r\n")));
}

} // namespace
