// What other programs write besides, or in another spelling: it is read, or named, but no reason to refuse a scan.
#include "pbm_scan/text/printable.h"
#include "unit/scan/readings.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

const std::string kSquareObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

std::string repeated(const std::string &line, int count) {
    std::string text;
    for (int i = 0; i < count; ++i)
        text += line;
    return text;
}

TEST(OptionalParts, IndicesOfWhatDoesNotExistCostOnlyThat) {
    const Surface zero = surface(kSquareObj + "vn 0 0 1\nf 1//0 2//0 3//1 4//1\n", "scan.obj");
    EXPECT_EQ(zero.triangles.size(), 2U);
    ASSERT_EQ(zero.normals.size(), 4U);
    EXPECT_EQ(zero.normals[2], glm::vec3(0, 0, 1));
    EXPECT_TRUE(reports(zero, "normals of 2 corners", Fate::dropped));
    const Surface beyond = surface(kSquareObj + "vn 0 0 1\nf 1//1 2//1 3//1\nf 1//1 3//1 4//2\n", "scan.obj");
    EXPECT_EQ(beyond.triangles.size(), 2U);
    EXPECT_TRUE(reports(beyond, "normals of 1 corner", Fate::dropped));
    const Surface none = surface(kSquareObj + "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n", "scan.obj");
    EXPECT_EQ(none.normals.size(), 4U);
    EXPECT_TRUE(reports(none, "texture coordinates of 4 corners", Fate::dropped));
    EXPECT_FALSE(read(kSquareObj + "f 1 2 3 5\n", "scan.obj").ok());
}

TEST(OptionalParts, PolypaintOfZBrushIsColours) {
    const std::string block = "#MRGB ffc83c1eff0000ffffffffff80010203\n";
    const Surface s = surface(kSquareObj + block + "f 1 2 3 4\n", "scan.obj");
    ASSERT_EQ(s.colours.size(), 4U);
    EXPECT_EQ(s.colours[0], (Rgb8{200, 60, 30}));
    EXPECT_EQ(s.colours[3], (Rgb8{1, 2, 3}));
    EXPECT_TRUE(reports(s, "#MRGB", Fate::kept));
    const Surface other = surface(kSquareObj + block + block + "f 1 2 3 4\n", "scan.obj");
    EXPECT_TRUE(other.colours.empty());
    EXPECT_TRUE(reports(other, "#MRGB", Fate::dropped));
}

TEST(OptionalParts, NearlyAllColoursDecideTheirRange) {
    const std::string line = "v 1 2 3 0.8 0.25 0.1\n";
    for (const char *odd : {"v 1 1 1 1.000001 0 0\n", "v 1 1 1 9 0 0\n"}) {
        const Surface s = surface(repeated(line, 200) + odd, "scan.obj");
        EXPECT_EQ(s.colours[0], (Rgb8{204, 64, 26})) << odd;
        EXPECT_EQ(s.colours[200], (Rgb8{255, 0, 0})) << odd;
        EXPECT_EQ(report(s, "vertex colours").note, "sRGB, 8 bits; 1 colour outside clamped");
    }
    const std::string ply = "ply\nformat ascii 1.0\nelement vertex 200\nproperty float x\nproperty float y\n"
                            "property float z\nproperty ushort red\nproperty ushort green\nproperty ushort blue\n"
                            "end_header\n1 1 1 60000 0 0\n";
    const Surface s = surface(ply + repeated("0 0 1 200 60 30\n", 199), "scan.ply");
    EXPECT_EQ(s.colours[1], (Rgb8{200, 60, 30}));
    EXPECT_TRUE(has(report(s, "vertex.red green blue").note, "1 colour outside clamped"));
}

TEST(OptionalParts, NumbersOfOldLibrariesAreNotFinite) {
    const Surface s =
        surface(kSquareObj + "vn 0 0 1\nvn -1.#IND -1.#IND00 1.#QNAN # a comment\nf 1//1 2//1 3//2 4//2\n", "scan.obj");
    EXPECT_EQ(s.triangles.size(), 2U);
    EXPECT_EQ(s.normals[0], glm::vec3(0, 0, 1));
    const Surface table = surface("0 0 1\n1.#QNAN 1.#INF -1.#INF\n0 1.5D+01 1d0\n", "scan.xyz");
    ASSERT_EQ(table.positions.size(), 2U);
    EXPECT_EQ(table.positions[1], glm::dvec3(0, 15, 1));
    for (const char *word : {"1.#X", "1.#", "D5", "1D", "1D+", "1D5x", "0x1D"})
        EXPECT_FALSE(read(std::string("0 0 1\n1 1 ") + word + "\n", "scan.xyz").ok()) << word;
}

TEST(OptionalParts, NamesOfPropertiesHaveAnyLetterCase) {
    const Surface s = surface("ply\nformat ascii 1.0\nelement Vertex 1\nproperty uchar Blue\nproperty uchar Green\n"
                              "property uchar RED\nproperty double X\nproperty double Y\nproperty double Z\n"
                              "end_header\n3 2 1 4 5 6\n",
                              "scan.ply");
    EXPECT_EQ(s.positions[0], glm::dvec3(4, 5, 6));
    EXPECT_EQ(s.colours[0], (Rgb8{1, 2, 3}));
    const Surface both = surface("ply\nformat ascii 1.0\nelement vertex 1\nproperty float X\nproperty float x\n"
                                 "property float y\nproperty float z\nend_header\n9 1 2 3\n",
                                 "scan.ply");
    EXPECT_EQ(both.positions[0], glm::dvec3(1, 2, 3)); // the exact name comes first
}

std::string facets_of_stl(std::uint32_t announced, std::size_t bytes) {
    std::string file(84 + bytes, '\0');
    std::memcpy(file.data() + 80, &announced, sizeof announced);
    const std::array<float, 9> corners{0, 0, 1, 1, 0, 0, 1, 1, 0};
    for (std::size_t at = 84; at + 50 <= file.size(); at += 50)
        std::memcpy(file.data() + at + 12, corners.data(), sizeof corners);
    return file;
}

TEST(OptionalParts, BytesBehindTheEndAreNamed) {
    for (const std::size_t behind : {1U, 92U}) {
        const Surface s = surface(facets_of_stl(2, 100) + std::string(behind, 'x'), "scan.stl");
        EXPECT_EQ(s.triangles.size(), 2U);
        EXPECT_EQ(report(s, "end of file").note, counted(behind, "byte") + " behind the last facet");
    }
    EXPECT_FALSE(read(facets_of_stl(2, 100 + 50), "scan.stl").ok()); // the count is wrong
    const std::string off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    EXPECT_EQ(report(surface(off + "end of file\n", "scan.off"), "end of file").note, "12 bytes behind the last face");
    EXPECT_FALSE(read(off + "3 0 1 2\n", "scan.off").ok());
}

TEST(OptionalParts, RecordsBehindTheAnnouncedOnesAreNoPoints) {
    const std::string row(12, '\1');
    const std::string ply =
        "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n";
    const std::string pcd = "# .PCD v0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
                            "DATA binary\n";
    for (const auto &[name, head] : {std::pair("scan.ply", ply), {"scan.pcd", pcd}}) {
        const Surface s = surface(head + repeated(row, 7), name);
        EXPECT_EQ(s.positions.size(), 2U);
        EXPECT_TRUE(has(report(s, "end of file").note, "60 bytes")) << name;
    }
}

TEST(OptionalParts, EndsAndCountsMayBeSpelledOtherwise) {
    std::string stl = "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nend loop\n"
                      "end facet\nEND SOLID\n";
    EXPECT_EQ(surface(stl, "scan.stl").triangles.size(), 1U);
    stl.replace(stl.find("end loop"), 8, "end what");
    EXPECT_FALSE(read(stl, "scan.stl").ok());
    EXPECT_EQ(surface("OFF3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "scan").triangles.size(), 1U);
    const std::string pcd = "# .PCD v0.7\nFIELDS x y z _ noise\nSIZE 4 4 4 1 1\nTYPE F F F U U\nCOUNT 1 1 1 0 0\n"
                            "WIDTH 1\nHEIGHT 1\nDATA ascii\n1 2 3\n";
    const Surface s = surface(pcd, "scan.pcd");
    EXPECT_EQ(s.positions[0], glm::dvec3(1, 2, 3));
    EXPECT_TRUE(reports(s, "columns noise", Fate::kept));
}

TEST(OptionalParts, AFileIsRecognisedByItsWholeMagicWord) {
    const std::string rows = "1 0 0 0\n2 1 0 0\n3 0 1 0\n";
    for (const char *name :
         {"COFFEE x y z\n", "OFFSET_TIME x y z\n", "camera x y z\n", "LASF_id x y z\n", "NGSP_id x y z\n"})
        EXPECT_EQ(surface(name + rows, "scan.txt").positions.size(), 3U) << name;
    for (const char *name : {"scan.glb", "scan.e57", "scan.ply", "scan.las"}) {
        EXPECT_TRUE(has(error("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n", name).message,
                        "pointer of Git LFS"));
        EXPECT_TRUE(has(error("\n <!DOCTYPE html>\n<html>", name).message, "page of HTML"));
    }
    EXPECT_TRUE(has(error("Hello, this is some text\n" + repeated("and more of it\n", 20), "scan.stl").message,
                    "a text that does not begin with 'solid'"));
    EXPECT_TRUE(
        has(error("# 3D point list with one line of data per point:\n#   POINT3D_ID, X, Y, Z\n", "x.txt").message,
            "COLMAP"));
    EXPECT_TRUE(has(error("camera -0.0172 -0.0936 -0.734\n", "bun.conf").message, "list of scans"));
}

TEST(OptionalParts, ColoursOfTablesWithoutNamesMayHaveAnOpacityOrALabelBehindThem) {
    std::string rgba, labels, pts, parts;
    for (int i = 0; i < 20; ++i) {
        const std::string place = std::to_string(i) + " 0 1.5 ", colour = "200 " + std::to_string(60 + i) + " 30";
        rgba += place + colour + " 255\n";
        labels += place + colour + " " + std::to_string(i % 4) + "\n";
        pts.append(place).append("7 ").append(colour).append("\n");
        parts += place + "0.8 0.25 0.1\n";
    }
    EXPECT_EQ(surface(rgba, "scan.txt").colours[0], (Rgb8{200, 60, 30}));
    EXPECT_EQ(surface(labels, "scan.txt").colours[0], (Rgb8{200, 60, 30}));
    EXPECT_EQ(surface(pts, "scan.txt").colours[0], (Rgb8{200, 60, 30}));
    EXPECT_EQ(surface(parts, "scan.xyzrgb").colours[0], (Rgb8{204, 64, 26}));
}

} // namespace
