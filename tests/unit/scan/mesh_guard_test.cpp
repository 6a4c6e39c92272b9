#include "unit/scan/readings.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace {

using pbm::Error;
using pbm::ErrorCode;
using pbm::Result;
using pbm::build::ReadOptions;
using pbm::build::Surface;
using namespace pbm::test;
using Colour = std::array<std::uint8_t, 3>;

constexpr std::string_view kObjName = "scan.obj", kOffName = "scan.off", kStlName = "scan.stl";

std::string refusal(const std::string &text, std::string_view name) {
    const Error refused = error(text, name);
    EXPECT_EQ(refused.code, ErrorCode::bad_input) << text;
    return refused.message;
}

const std::string kObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
const std::string kOff = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";

std::string facet(const std::string &a, const std::string &b, const std::string &c) {
    return "facet normal 0 0 1\nouter loop\nvertex " + a + "\nvertex " + b + "\nvertex " + c + "\nendloop\nendfacet\n";
}

TEST(ObjComments, AnnouncedCountsAreHeldAgainstTheFile) {
    for (const char *whole :
         {"# Vertices: 4\n# Faces: 2\n", "# 4 vertices, 2 faces\n", "#4 vertices, 0 vertices normals\n",
          "#\t  Vertices: 4\n", "# vertices = 4, triangles = 2\n", "# 3 vertices\n# 1 vertices\n", "# Polygons: 2\n"})
        EXPECT_EQ(surface(whole + kObj, kObjName).triangles.size(), 2U) << whole;
    EXPECT_EQ(surface(kObj + "# 4 vertices, 2 faces", kObjName).triangles.size(), 2U);
    for (const char *more : {"# Vertices: 5\n", "# 5 vertices, 2 faces\n", "#  VERTICES: 5\r\n"})
        EXPECT_EQ(refusal("# x\n" + (more + kObj), kObjName),
                  "line 2: the comment announces 5 vertices, but the file has 4: it is cut short; copy or export it "
                  "again");
    for (const char *more : {"# Faces: 3\n", "# 4 vertices, 3 faces\n", "# 3 polygons\n"})
        EXPECT_TRUE(has(refusal(more + kObj, kObjName), "announces 3 faces, but the file has 2")) << more;
    EXPECT_TRUE(has(refusal("# 3 triangles\n" + kObj, kObjName), "announces 3 triangles, but the file has 2"));
}

TEST(ObjComments, OtherTalkOfNumbersIsNoAnnouncement) {
    for (const char *talk :
         {"# simplified from 200000 vertices\n", "# 100000 vertices in the original\n", "# version 4000\n",
          "# texture coordinates: 9\n", "# 12 faces 14\n", "# 99 vertices normals\n", "# faces\n", "# 7\n",
          "v 0 0 0 # 90 vertices\nv 1 0 0\nv 1 1 0\n", "# 99999999999999999999 vertices\n", "# Vertices: 1e9\n"})
        EXPECT_TRUE(read(talk + kObj, kObjName).ok()) << talk;
}

TEST(ObjComments, ACutFileIsRefusedWhereverItsHeadAnnouncesCounts) {
    const std::string file = "# Vertices: 4\n# Faces: 2\n" + kObj;
    const std::size_t last_line = file.rfind("f 1 3 4");
    for (std::size_t size = 27; size < last_line + 6; ++size)
        EXPECT_FALSE(read(file.substr(0, size), kObjName).ok()) << size;
}

TEST(ObjGuard, ALastLineWithoutAnEndIsNamedAndStrictLetsItPass) {
    for (const std::string &file :
         {kObj.substr(0, kObj.size() - 1), std::string("v 0 0 0\nv 1 0 0"), std::string("v 0 0 0\nvn 0 0 1")}) {
        const Surface s = surface(file, kObjName);
        EXPECT_TRUE(reports(s, "end of file", Fate::kept)) << file;
    }
    ReadOptions strict;
    strict.strict = true;
    EXPECT_TRUE(read(kObj.substr(0, kObj.size() - 1), kObjName, strict).ok());
    for (const std::string &file : {kObj, kObj + "# no end", kObj + "g last", kObj + "\n  "})
        EXPECT_FALSE(reports(surface(file, kObjName), "end of file", Fate::kept)) << file;
}

TEST(ObjGuard, ALastVertexWithFewerNumbersThanItsNeighboursIsCut) {
    const std::string file = "v 0 0 0 0.5 0.5 0.5\nv 1 0 0 0.5 0.5 0.5";
    EXPECT_EQ(surface(file, kObjName).colours.size(), 2U);
    for (const std::size_t less : {4U, 8U, 12U})
        EXPECT_TRUE(has(refusal(file.substr(0, file.size() - less), kObjName), "line 2: ")) << less;
}

TEST(ObjGuard, BackslashesOfCommentsAndNamesSwallowNothing) {
    const Surface s = surface(
        "# from C:\\scans\\\nv 0 0 0\ng C:\\scans\\\nv 1 0 0\nusemtl a\\\nv 1 1 0\nf 1 \\\n2 \\ \n3\n", kObjName);
    EXPECT_EQ(s.positions.size(), 3U);
    EXPECT_EQ(s.triangles.size(), 1U);
    EXPECT_EQ(surface("v 0 0 \\\n\\\n0\nv 1 0 0\nv 1 1 0\nf 1 2 3 \\\n", kObjName).triangles.size(), 1U);
    EXPECT_TRUE(has(refusal("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3 \\", kObjName), "line 4: "));
}

TEST(ObjGuard, AByteOrderMarkHidesNothing) {
    EXPECT_EQ(surface("\xEF\xBB\xBF" + kObj, kObjName).positions.size(), 4U);
    EXPECT_EQ(surface("\xEF\xBB\xBF" + kOff, kOffName).positions.size(), 4U);
    EXPECT_EQ(
        surface("\xEF\xBB\xBFsolid x\n" + facet("0 0 0", "1 0 0", "1 1 0") + "endsolid x\n", kStlName).triangles.size(),
        1U);
}

TEST(ObjGuard, StatementsThatAreNoneAreRefusedAndUnknownWordsNamed) {
    for (const char *line :
         {"V 0 0 0\n", "F 1 2 3\n", "x 1 2 3\n", "0.5 1 2\n", "f1 2 3\n", "v0 0 0\n", "\x01 1\n", "/ comment\n"})
        EXPECT_TRUE(has(refusal(kObj + line, kObjName), "line 7: ")) << line;
    EXPECT_FALSE(has(refusal(kObj + "\x1b[31m 1\n", kObjName), "\x1b"));
    const Surface s = surface(kObj + "vcolor 1 0 0\nvcolor 0 1 0\n", kObjName);
    EXPECT_TRUE(reports(s, "statements 'vcolor'", Fate::dropped));
    EXPECT_TRUE(surface(kObj + "s 1\no x\nmg 0\nusemap off\nend\n\x1a", kObjName).triangles.size() == 2);
}

// An algorithm quadratic in the size of the file would time out here.
TEST(ObjGuard, LongFilesOfOneOddThingAreReadInOnePass) {
    constexpr int kMany = 2'000'000;
    std::string joined, words = kObj, files = kObj;
    for (int i = 0; i < kMany; ++i)
        joined += "\\\n";
    for (int i = 0; i < kMany / 8; ++i) {
        std::string word = "statement_";
        for (int rest = i; rest != 0; rest /= 26)
            word += static_cast<char>('a' + rest % 26);
        words += word + "\n";
        files += "mtllib " + word + ".mtl\n";
    }
    EXPECT_EQ(surface(joined + "\n" + kObj, kObjName).triangles.size(), 2U);
    const Surface s = surface(words, kObjName);
    EXPECT_TRUE(reports(s, "further statements", Fate::dropped));
    EXPECT_LT(s.report.size(), 24U);
    EXPECT_LT(surface(files, kObjName).report.size(), 24U);
}

TEST(ObjGuard, CurvesAndLinesAreNamed) {
    const Surface s = surface(kObj + "vp 0.5 0.5\ncstype bezier\ndeg 3\ncurv 0 1 1 2 3 4\nl 1 2\np 1\n", kObjName);
    EXPECT_TRUE(reports(s, "free-form curves", Fate::dropped));
    EXPECT_TRUE(reports(s, "lines", Fate::dropped));
    EXPECT_TRUE(reports(s, "points 'p'", Fate::dropped));
}

TEST(ObjGuard, PointsNeedNoFaces) {
    const Surface s = surface("v 0 0 0\nv 1 0 0\np 1 2\np -1\n", kObjName);
    EXPECT_EQ(s.positions.size(), 2U);
    EXPECT_FALSE(reports(s, "points", Fate::dropped));
    EXPECT_FALSE(reports(s, "faces", Fate::kept));
}

TEST(ObjGuard, NormalsThatNoFaceNamesBelongToTheVertices) {
    const std::string two = "vn 0 0 1\nv 0 0 0\nvn 0 2 0\nv 1 0 0\n";
    const Surface s = surface(two, kObjName);
    ASSERT_EQ(s.normals.size(), 2U);
    EXPECT_EQ(s.normals[1], glm::vec3(0, 2, 0));
    EXPECT_TRUE(reports(s, "normals", Fate::kept));
    const Surface more = surface(two + "vn 1 0 0\n", kObjName);
    EXPECT_TRUE(more.normals.empty());
    EXPECT_TRUE(reports(more, "normals", Fate::dropped));
}

TEST(ObjGuard, WeightsAndFurtherNumbersAreNamed) {
    EXPECT_TRUE(reports(surface("v 0 0 0 1\nv 1 0 0 1\n", kObjName), "vertex weights", Fate::dropped));
    EXPECT_TRUE(reports(surface("v 0 0 0 1 1\n", kObjName), "a fourth and a fifth number", Fate::dropped));
}

TEST(ObjGuard, AFaceWithRepeatedCornersIsNoReasonToRefuse) {
    const Surface s = surface(kObj + "f 1 2 1 3\nf 1 1 1\nf 2 2 3 4\n", kObjName);
    EXPECT_GE(s.triangles.size() + s.dropped_triangles, 5U);
    const Surface off = surface("OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 0 2\n3 0 2 3\n", kOffName);
    EXPECT_EQ(off.triangles.size() + off.dropped_triangles, 3U);
}

TEST(OffGuard, HeadersInAnyOrderAreUnderstood) {
    const auto file = [](const std::string &header, const std::string &tail) {
        return header + "\n3 1 0\n0 0 0" + tail + "\n1 0 0" + tail + "\n1 1 0" + tail + "\n3 0 1 2\n";
    };
    EXPECT_EQ(surface(file("COFF", " 255 0 7 255"), kOffName).colours[1], (Colour{255, 0, 7}));
    EXPECT_EQ(surface(file("COFF", " 1 0.5 0 1"), kOffName).colours[1], (Colour{255, 128, 0}));
    EXPECT_EQ(surface(file("NOFF", " 0 0 2"), kOffName).normals[2], glm::vec3(0, 0, 2));
    for (const char *both : {"CNOFF", "NCOFF"}) {
        const Surface s = surface(file(both, " 0 0 1 9 8 7 255"), kOffName);
        EXPECT_EQ(s.normals[0], glm::vec3(0, 0, 1)) << both;
        EXPECT_EQ(s.colours[0], (Colour{9, 8, 7})) << both;
    }
    const Surface texture = surface(file("STOFF", " 0.5 0.5"), kOffName);
    EXPECT_TRUE(texture.colours.empty());
    EXPECT_TRUE(reports(texture, "texture coordinates", Fate::dropped));
    EXPECT_EQ(surface(file("STCOFF", " 9 8 7 255 0.5 0.5"), kOffName).colours[0], (Colour{9, 8, 7}));
    EXPECT_TRUE(reports(surface(file("COFF", ""), kOffName), "vertex colours", Fate::dropped));
}

TEST(OffGuard, FaceColoursAreThoseOfTheFaces) {
    const std::string head = "OFF\n5 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n9 9 9\n";
    const Surface s = surface(head + "3 0 1 2 200 0 0\n3 0 2 3 0 100 0 255\n", kOffName);
    EXPECT_TRUE(s.colours.empty());
    EXPECT_EQ(s.face_colours, (std::vector<pbm::build::FaceColour>{{{200, 0, 0}, true}, {{0, 100, 0}, true}}));
    EXPECT_TRUE(reports(s, "face colours", Fate::kept));
    EXPECT_EQ(surface(head + "3 0 1 2 1 0.5 0\n3 0 2 3 1 0.5 0\n", kOffName).face_colours[1].colour,
              (Colour{255, 128, 0}));
    const Surface some = surface(head + "3 0 1 2\n4 0 1 2 3 0 100 0 255\n", kOffName);
    EXPECT_EQ(some.face_colours, (std::vector<pbm::build::FaceColour>{{}, {{0, 100, 0}, true}, {{0, 100, 0}, true}}));
    EXPECT_EQ(note_of(some, "face colours"), "sRGB, 8 bits; 1 triangle without one has that of the material");
    EXPECT_TRUE(reports(surface(head + "3 0 1 2 7\n3 0 2 3 7\n", kOffName), "colour indices", Fate::dropped));
    EXPECT_TRUE(has(refusal(head + "3 0 1 2 red\n3 0 2 3\n", kOffName), "line 8: 'red'"));
}

TEST(OffGuard, ALastLineWithoutAnEndIsNamed) {
    EXPECT_FALSE(reports(surface(kOff, kOffName), "end of file", Fate::kept));
    EXPECT_TRUE(reports(surface(kOff.substr(0, kOff.size() - 1), kOffName), "end of file", Fate::kept));
    EXPECT_TRUE(reports(surface("OFF\n1 0 0\n1 2 3", kOffName), "end of file", Fate::kept));
}

TEST(MeshPrecision, CoordinatesOfAMapSurviveInText) {
    const glm::dvec3 a(8500000.125, 8500000.25, 0.001), b(8500000.1250001, 8500000.25, 0.001), c(8500001, 0, 0);
    const Surface obj = surface("v 8500000.125 8500000.25 0.001\nv 8500000.1250001 8500000.25 0.001\nv 8500001 0 0\n"
                                "f 1 2 3\n",
                                kObjName);
    const Surface off = surface("OFF 3 1 0\n8500000.125 8500000.25 0.001\n8500000.1250001 8500000.25 0.001\n"
                                "8500001 0 0\n3 0 1 2\n",
                                kOffName);
    const Surface stl = surface(
        "solid\n" + facet("8500000.125 8500000.25 0.001", "8500000.1250001 8.50000025E+06 1e-3", "8500001 0 -0.0") +
            facet("8500001 0 0", "8500000.1250001 8500000.25 0.001", "0 0 0") + "endsolid\n",
        kStlName);
    for (const Surface *s : {&obj, &off, &stl}) {
        ASSERT_GE(s->positions.size(), 3U);
        EXPECT_EQ(s->positions[0], a);
        EXPECT_EQ(s->positions[1], b);
        EXPECT_EQ(s->positions[2], c);
        EXPECT_EQ(s->triangles[0], glm::uvec3(0, 1, 2));
    }
    ASSERT_EQ(stl.triangles.size(), 2U);
    EXPECT_EQ(stl.positions.size(), 4U);
    EXPECT_EQ(stl.triangles[1], glm::uvec3(2, 1, 3));
}

TEST(StlGuard, ManyVerticesAreWeldedByTheirNumbers) {
    // Many vertices: the indices that replace coordinates must stay distinct.
    std::string file = "solid strip\n";
    constexpr int kFacets = 70'000;
    const auto corner = [](int i) { return std::to_string(i / 2) + " " + std::to_string(i % 2) + " 0"; };
    for (int i = 0; i < kFacets; ++i)
        file += facet(corner(i), corner(i + 1), corner(i + 2));
    const Surface s = surface(file + "endsolid strip\n", kStlName);
    ASSERT_EQ(s.positions.size(), kFacets + 2U);
    ASSERT_EQ(s.triangles.size(), static_cast<std::size_t>(kFacets));
    for (std::uint32_t i = 0; i < kFacets; ++i)
        ASSERT_EQ(s.triangles[i], glm::uvec3(i, i + 1, i + 2));
    EXPECT_EQ(s.positions[kFacets + 1], glm::dvec3((kFacets + 1) / 2, (kFacets + 1) % 2, 0));
}

// One step of a multiplicative hash, as hash tables of coordinates use. It is invertible.
std::uint64_t mixed(std::uint64_t bits) {
    const std::uint64_t product = bits * 0x9E3779B97F4A7C15U;
    return product ^ product >> 29;
}

// Coordinates with colliding hashes: a search through all earlier vertices would time out here.
TEST(StlGuard, CoordinatesThatFoolAHashAreWeldedAllTheSame) {
    constexpr std::size_t kFacets = 60'000;
    std::mt19937_64 random(1);
    std::vector<std::string> corners;
    while (corners.size() < 3 * kFacets) {
        const double x = static_cast<double>(random() >> 11) * 0x1p-53;
        const auto y =
            std::bit_cast<double>(mixed(std::bit_cast<std::uint64_t>(x)) ^ std::bit_cast<std::uint64_t>(1.5));
        if (!(std::fabs(y) > 1e-9 && std::fabs(y) < 1e3))
            continue;
        std::array<char, 80> text{};
        std::snprintf(text.data(), text.size(), "%.17g %.17g 1", x, y);
        corners.emplace_back(text.data());
    }
    std::string file = "solid\n";
    for (std::size_t i = 0; i < corners.size(); i += 3)
        file += facet(corners[i], corners[i + 1], corners[i + 2]) + facet(corners[i + 1], corners[i], corners[i + 2]);
    const Surface s = surface(file + "endsolid\n", kStlName);
    ASSERT_EQ(s.positions.size(), 3 * kFacets);
    ASSERT_EQ(s.triangles.size(), 2 * kFacets);
    EXPECT_EQ(s.triangles.back(), glm::uvec3(3 * kFacets - 2, 3 * kFacets - 3, 3 * kFacets - 1));
}

TEST(StlGuard, OddSpellingsAreUnderstood) {
    const Surface s = surface("SOLID Two Words\r\nFACET NORMAL 0 0 1\r\nOUTER LOOP\r\nVERTEX 0 0 0\r\n"
                              "VERTEX +1.0E+00 0 0\r\n\tVertex 1.0e0 1.0E-000 -.0\r\nENDLOOP\r\nENDFACET\r\n"
                              "ENDSOLID Two Words\r\nsolid\n" +
                                  facet("5 5 5", "6 5 5", "6 6 5") + "endsolid",
                              kStlName);
    EXPECT_EQ(s.triangles.size() + s.dropped_triangles, 2U);
    EXPECT_TRUE(reports(s, "facet normals", Fate::converted));
}

TEST(StlGuard, ACutBinaryFileThatBeginsWithSolidIsNamedAsWhatItIs) {
    std::string file = "solid exported by a program";
    file.resize(80, '\0');
    file += std::string("\2\0\0\0", 4) + std::string(100, '\0');
    EXPECT_TRUE(read(file, kStlName).ok());
    EXPECT_TRUE(has(refusal(file.substr(0, 150), kStlName), "binary STL of 2 facets must have 184 bytes"));
}

TEST(MeshReaders, ProgressRisesToOne) {
    std::string file = "OFF\n3 60000 0\n0 0 0\n1 0 0\n1 1 0\n";
    for (int i = 0; i < 60'000; ++i)
        file += "3 0 1 2\n";
    std::vector<double> seen;
    ReadOptions options;
    options.progress = [&](double done) { seen.push_back(done); };
    ASSERT_TRUE(read(file, kOffName, options).ok());
    EXPECT_GE(seen.size(), 8U);
    EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
    EXPECT_EQ(seen.back(), 1.0);
}

} // namespace
