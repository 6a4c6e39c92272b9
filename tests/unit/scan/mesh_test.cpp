#include "pbm_scan/packing/compressed.h"
#include "system/threads/cancellation.h"
#include "unit/scan/readings.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <zlib.h>
#include <zstd.h>

namespace {

using pbm::Error;
using pbm::ErrorCode;
using pbm::Result;
using pbm::build::FaceColour;
using pbm::build::Surface;
using namespace pbm::test;
using Colour = std::array<std::uint8_t, 3>;

constexpr std::string_view kObjName = "scan.obj", kOffName = "scan.off", kStlName = "scan.stl";

const std::string kObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
const std::string kOff = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";

// Binary STL; a facet has three corners of three coordinates.
std::string binary_stl(const std::vector<std::array<float, 9>> &facets, std::string header = "binary") {
    header.resize(80, ' ');
    const auto count = static_cast<std::uint32_t>(facets.size());
    std::string out = header + std::string(reinterpret_cast<const char *>(&count), 4);
    for (const std::array<float, 9> &corners : facets)
        out += std::string(12, '\0') + std::string(reinterpret_cast<const char *>(corners.data()), sizeof corners) +
               std::string(2, '\0');
    return out;
}

const std::vector<std::array<float, 9>> kTwoFacets = {{0, 0, 0, 1, 0, 0, 1, 1, 0}, {0, 0, 0, 1, 1, 0, 0, 1, 0}};

const std::string kAsciiStl = "solid outer space\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n"
                              "  vertex 1 1 0\n endloop\nendfacet\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n"
                              "  vertex 1 1 0\n  vertex 0 1 0\n endloop\nendfacet\nendsolid\n";

TEST(ObjReader, PolygonsAreFanned) {
    const Surface s = surface(kObj, kObjName);
    ASSERT_EQ(s.positions.size(), 4U);
    ASSERT_EQ(s.triangles.size(), 2U);
    EXPECT_EQ(s.triangles[1], glm::uvec3(0, 2, 3));
}

TEST(ObjReader, PositionsKeepDoublePrecision) {
    const Surface s = surface("v 8500000.123456 1e-300 -3\nv 1 0 0\nv 1e300 1 0\nf 1 2 3\n", kObjName);
    EXPECT_EQ(s.positions[0], glm::dvec3(8500000.123456, 1e-300, -3));
    EXPECT_EQ(s.positions[2].x, 1e300);
    EXPECT_EQ(s.triangles.size(), 1U);
}

TEST(ObjReader, ColoursOfVerticesAreKept) {
    const Surface unit = surface("v 0 0 0 1 0.502 0\nv 1 0 0 0 0 0\nv 1 1 0 0 0 1\nf 1 2 3\n", kObjName);
    EXPECT_EQ(unit.colours[0], (Colour{255, 128, 0}));
    const Surface points = surface("v 0 0 0 255 128 0\nv 1 0 0 0 0 0\n", kObjName);
    EXPECT_EQ(points.colours[0], (Colour{255, 128, 0}));
    const Surface some = surface("v 0 0 0\nv 1 0 0 1 0 0\nv 1 1 0\nf 1 2 3\n", kObjName);
    const Colour own = pbm::Material{}.colour; // of the vertices without one
    EXPECT_EQ(some.colours, (std::vector<Colour>{own, {255, 0, 0}, own}));
    EXPECT_EQ(report(some, "vertex colours").note, "sRGB, 8 bits; 2 vertices without one have that of the material");
}

TEST(ObjReader, VerticesAreSplitWhereCornersHaveDifferentNormals) {
    const std::string head = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 2\nvn 0 1 0\n";
    const Surface same = surface(head + "f 1//1 2//1 3//1\n", kObjName);
    ASSERT_EQ(same.normals.size(), 3U);
    EXPECT_EQ(same.normals[2], glm::vec3(0, 0, 2));
    EXPECT_TRUE(reports(same, "normals", Fate::kept));
    // Two faces agree on the second normal of vertex 3; vertex 4 follows the faces that name it.
    const Surface split = surface(head + "f 1//1 2//1 3//1\nf 3//2 2//1 1//1\nf 4//2 3//2 2//1\nv 2 2 0 \n", kObjName);
    EXPECT_EQ(split.triangles, (std::vector<glm::uvec3>{{0, 1, 2}, {4, 1, 0}, {3, 4, 1}}));
    ASSERT_EQ(split.positions.size(), 5U);
    EXPECT_EQ(split.positions[4], split.positions[2]);
    ASSERT_EQ(split.normals.size(), 5U);
    EXPECT_EQ(split.normals[2], glm::vec3(0, 0, 2));
    EXPECT_EQ(split.normals[3], glm::vec3(0, 1, 0));
    EXPECT_EQ(split.normals[4], glm::vec3(0, 1, 0));
    EXPECT_TRUE(reports(split, "normals", Fate::kept));
    const Surface coloured = surface("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nvn 0 0 2\nvn 0 1 0\n"
                                     "f 1//1 2//1 3//1\nf 3//2 2//1 1//1\n",
                                     kObjName);
    ASSERT_EQ(coloured.colours.size(), 4U);
    EXPECT_EQ(coloured.colours[3], (Colour{0, 0, 255}));
}

TEST(ObjReader, TheHubOfAFanMayHaveManyNormals) {
    std::string text = "v 0 0 1\nv 1 0 0\nv 0 1 0\n";
    for (int i = 1; i <= 1000; ++i)
        text += "vn 1 0 " + std::to_string(i) + "\n";
    for (int i = 1; i <= 1000; ++i)
        text += "f 1//" + std::to_string(i) + " 2//1 3//1\n";
    const Surface s = surface(text, kObjName);
    ASSERT_EQ(s.positions.size(), 1002U);
    for (std::size_t i = 0; i < s.triangles.size(); ++i)
        EXPECT_EQ(s.normals[s.triangles[i].x], glm::vec3(1, 0, static_cast<float>(i + 1)));
}

TEST(ObjReader, IndicesMayBeNegativeOrRunAhead) {
    EXPECT_EQ(surface("v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\n", kObjName).triangles[0], glm::uvec3(0, 1, 2));
    EXPECT_EQ(surface("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 1 1 0\n", kObjName).triangles[0], glm::uvec3(0, 1, 2));
}

TEST(ObjReader, MaterialsTexturesAndLinesAreReportedAndNoFileIsOpened) {
    const Surface s = surface("mtllib no_such_file.mtl\nusemtl x\nvt 0\nl 1 2\n" + kObj + "f 1/1 2/1 3/1\n", kObjName);
    EXPECT_EQ(s.triangles.size(), 3U);
    EXPECT_TRUE(reports(s, "'no_such_file.mtl'", Fate::dropped));
    EXPECT_TRUE(reports(s, "texture coordinates", Fate::dropped));
    EXPECT_TRUE(reports(s, "lines", Fate::dropped));
    EXPECT_TRUE(reports(surface("mtllib  a.mtl b.mtl \r\n" + kObj, kObjName), "'a.mtl b.mtl'", Fate::dropped));
}

TEST(ObjReader, LineEndsCommentsAndContinuedLinesAreUnderstood) {
    std::string cr = kObj;
    for (char &c : cr)
        c = c == '\n' ? '\r' : c;
    EXPECT_EQ(surface(cr, kObjName).triangles.size(), 2U);
    EXPECT_EQ(
        surface("v 0 0 0\r\nv 1 0 0 # x\r\nv 1 \\\r\n 1 0\r\n# f\r\nf 1 2 \\\r\n3 # 4\r\n", kObjName).triangles.size(),
        1U);
    EXPECT_EQ(surface("\fv 0 0 0\n\vv 1 0 0\nv\f1 1 0\nf 1 2 3\n", kObjName).triangles.size(), 1U);
    EXPECT_EQ(surface("v 0 0 0\nv 1 0 0\nv 1 1 0\nfo 1 2 3\n", kObjName).triangles.size(), 1U);
}

TEST(ObjReader, VerticesThatAreNotFiniteGoWithTheirFaces) {
    const Surface s = surface("v nan 0 0\n" + kObj.substr(0, kObj.size() - 10) + "f 2 3 4\nf 1 2 3\n", kObjName);
    EXPECT_EQ(s.dropped_vertices, 1U);
    EXPECT_EQ(s.positions.size(), 4U);
    ASSERT_EQ(s.triangles.size(), 1U);
    EXPECT_EQ(s.triangles[0], glm::uvec3(0, 1, 2));
}

TEST(ObjReader, AHoleReachedByASlitStaysOpen) {
    const Surface s = surface("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\n"
                              "f 1 2 3\nf 1 2 3 4 1 5 6 7 8 5\nf 1 2 4\n",
                              kObjName);
    ASSERT_EQ(s.triangles.size(), 1U + 8U + 1U);
    double area = 0;
    for (std::size_t i = 1; i < 9; ++i) {
        const glm::uvec3 t = s.triangles[i];
        const glm::dvec3 u = s.positions[t.y] - s.positions[t.x], v = s.positions[t.z] - s.positions[t.x];
        EXPECT_GT(u.x * v.y - u.y * v.x, 0.0);
        area += 0.5 * (u.x * v.y - u.y * v.x);
    }
    EXPECT_DOUBLE_EQ(area, 16.0 - 4.0);
}

TEST(ObjReader, DegenerateFacesAreCounted) {
    const Surface s = surface(kObj + "f 1 1 2\nf 1 2\nf 1 2 2 3\n", kObjName);
    EXPECT_EQ(s.triangles.size(), 3U);
    EXPECT_EQ(s.dropped_triangles, 3U);
}

TEST(ObjReader, DamagedTextIsRefusedWithItsLine) {
    for (const char *bad : {"v 1 2\n", "v 1 x 2\n", "v 1 0,5 2\n", "f 1 2 5\n", "f 0 1 2\n", "f -9 1 2\n", "f a b c\n",
                            "vn 0 1\n", "f 1/x 2 3\n", "f 1.5 2 3\n", "f 1 2 99999999999999999999\n"}) {
        const Error e = error(kObj + bad, kObjName);
        EXPECT_EQ(e.code, ErrorCode::bad_input);
        EXPECT_TRUE(has(e.message, "line 6: ")) << e.message;
        EXPECT_EQ(e.offset, kObj.size());
    }
    EXPECT_EQ(error(kObj + std::string(1, '\0'), kObjName).offset, kObj.size());
    EXPECT_EQ(error("# nothing\n", kObjName).code, ErrorCode::bad_input);
}

TEST(MeshReaders, FacesOfManyCornersAreReadWhole) {
    constexpr int kCorners = 5000;
    std::string vertices, obj = "f", off = std::to_string(kCorners);
    for (int i = 0; i < kCorners; ++i) {
        const double around = 6.283185307179586 * i / kCorners;
        vertices += std::to_string(std::cos(around)) + ' ' + std::to_string(std::sin(around)) + " 0\n";
        obj += ' ' + std::to_string(i - kCorners);
        off += ' ' + std::to_string(i);
    }
    std::string obj_vertices;
    for (std::size_t begin = 0; begin < vertices.size(); begin = vertices.find('\n', begin) + 1)
        obj_vertices += "v " + vertices.substr(begin, vertices.find('\n', begin) + 1 - begin);
    obj_vertices.append(obj).append("\nf 1 2 3\n");
    std::string off_text = "OFF\n";
    off_text.append(std::to_string(kCorners)).append(" 2 0\n").append(vertices).append(off).append("\n3 0 1 2\n");
    for (const Surface &s : {surface(obj_vertices, kObjName), surface(off_text, kOffName)}) {
        EXPECT_EQ(s.positions.size(), std::size_t{kCorners});
        ASSERT_EQ(s.triangles.size(), std::size_t{kCorners} - 1);
        EXPECT_EQ(s.triangles.back(), glm::uvec3(0, 1, 2)) << "the face behind it";
        double area = 0;
        for (std::size_t i = 0; i + 1 < s.triangles.size(); ++i) {
            const glm::dvec3 a = s.positions[s.triangles[i].x];
            area += glm::cross(s.positions[s.triangles[i].y] - a, s.positions[s.triangles[i].z] - a).z / 2;
        }
        EXPECT_NEAR(area, 3.14159, 1e-4);
    }
    std::string same = "f";
    for (int i = 0; i < kCorners; ++i)
        same += " 1";
    const Surface dropped = surface(kObj + same + "\n", kObjName);
    EXPECT_EQ(dropped.dropped_triangles, 1U);
}

TEST(ObjReader, ALastLineCutInsideIsRefused) {
    const std::string vertices = kObj.substr(0, kObj.find('f'));
    for (const char *cut : {"v 1", "v 1 2", "v 1 2 -", "f", "f 1", "f 1 2", "vn 0 0"})
        EXPECT_EQ(error(vertices + cut, kObjName).code, ErrorCode::bad_input) << cut;
}

TEST(OffReader, AWholeFileIsReadAndEveryCutRefused) {
    const Surface s = surface(kOff, kOffName);
    EXPECT_EQ(s.positions.size(), 4U);
    ASSERT_EQ(s.triangles.size(), 2U);
    EXPECT_EQ(s.triangles[1], glm::uvec3(0, 2, 3));
    for (std::size_t size = 0; size + 2 <= kOff.size(); ++size)
        EXPECT_EQ(error(kOff.substr(0, size), kOffName).code, ErrorCode::bad_input) << size;
}

TEST(ObjReader, SmoothingGroupsAreThoseOfTheirFaces) {
    const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n", quad = "f 1 2 3 4\n", half = "f 1 2 3\n";
    using Groups = std::vector<std::uint32_t>;
    const std::uint32_t flat = Surface::kFlat;
    const Surface mixed = surface(square + half + "s 3\n" + quad + "s OFF\n" + half + "s 9\ns 0\n" + half, "a.obj");
    EXPECT_EQ(mixed.smoothing_groups, (Groups{flat, 3, 3, flat, flat}));
    EXPECT_FALSE(mixed.crease_angle);
    EXPECT_EQ(note_of(mixed, "smoothing groups"),
              "3 triangles of 5 flat, others smooth within their group; --crease-angle overrules them");
    const Surface off = surface(square + "s off\n" + quad, "a.obj");
    EXPECT_TRUE(off.smoothing_groups.empty());
    EXPECT_EQ(off.crease_angle, 0.0);
    const Surface none = surface(square + quad, "a.obj");
    EXPECT_TRUE(none.smoothing_groups.empty());
    EXPECT_FALSE(none.crease_angle);
    // Normals win, but corners may lack them.
    const std::string normals = "vn 0 0 1\ns off\n";
    const Surface given = surface(square + normals + "f 1//1 2//1 3//1 4//1\n", "a.obj");
    EXPECT_FALSE(given.crease_angle);
    EXPECT_EQ(note_of(given, "smoothing groups"), "as the normals have it");
    EXPECT_EQ(surface(square + normals + "f 1//1 2 3 4\n", "a.obj").crease_angle, 0.0);
    EXPECT_TRUE(reports(surface(square + "s one\n" + quad, "a.obj"), "smoothing groups that", Fate::dropped));
}

TEST(OffReader, HeadersCommentsAndColoursAreUnderstood) {
    const Surface s =
        surface("# made by hand\nCNOFF 3 1 0 # counts\n\n0 0 0 0 0 1 255 0 0 255\n1 0 0 0 0 1 0 255 0 255\n"
                "# between\n1 1 0 0 0 1 0 0 255 255\n3 0 1 2 128 0 0\n",
                kOffName);
    EXPECT_EQ(s.triangles.size(), 1U);
    EXPECT_EQ(s.colours[1], (Colour{0, 255, 0}));
    EXPECT_EQ(s.normals[2], glm::vec3(0, 0, 1));
    EXPECT_TRUE(reports(s, "face colours", Fate::dropped));
}

TEST(OffReader, CountsThatLieAndBadRowsAreRefused) {
    const auto with_counts = [](const std::string &counts) { return "OFF\n" + counts + kOff.substr(9); };
    EXPECT_EQ(surface(with_counts("4 2 0"), kOffName).triangles.size(), 2U);
    EXPECT_EQ(surface(with_counts("4 2 0 1 1"), kOffName).positions[0], glm::dvec3(0));
    for (const char *counts :
         {"5 2 0", "4 3 0", "4294967295 2 0", "4 4294967295 0", "3 2 0", "-4 2 0", "4 2", "x 2 0", "1e9 2 0"})
        EXPECT_EQ(error(with_counts(counts), kOffName).code, ErrorCode::bad_input) << counts;
    const std::string head = kOff.substr(0, kOff.rfind("3 0 2 3"));
    for (const char *row : {"3 0 1 4\n", "3 0 -1 2\n", "4 0 1 2\n", "3 0 1\n", "x\n"})
        EXPECT_TRUE(has(error(head + row, kOffName).message, "line 8: ")) << row;
    EXPECT_TRUE(has(error(head + "4294967295 0 1 2\n", kOffName).message, "ends early"));
    EXPECT_EQ(error("4OFF\n1 0 0\n1 2 3 4\n", kOffName).code, ErrorCode::unsupported_feature);
}

TEST(OffReader, WordsMayStandOnAnyLine) {
    const Surface by_lines = surface(kOff, kOffName);
    for (const char from : {'\n', ' '}) { // one line; a line for each word
        std::string file = kOff;
        std::replace(file.begin(), file.end(), from, from == ' ' ? '\n' : ' ');
        const Surface s = surface(file, kOffName);
        EXPECT_EQ(s.positions, by_lines.positions);
        EXPECT_EQ(s.triangles, by_lines.triangles);
        for (std::size_t size = 0; size + 2 < file.size(); ++size)
            EXPECT_FALSE(read(file.substr(0, size), kOffName).ok()) << size;
    }
    const Surface s = surface("# Words\nCNOFF 3 # a comment\n1 0 0 0 0 0 0 1 255 0 0 255 1 0\n0 0 0 1 0 255 0 255\n"
                              "1 1 0 0 0 1 0 0 255 255 3 0 # a comment\n1 2",
                              kOffName);
    EXPECT_EQ(s.positions[2], glm::dvec3(1, 1, 0));
    EXPECT_EQ(s.colours[1], (Colour{0, 255, 0}));
    EXPECT_EQ(s.normals[2], glm::vec3(0, 0, 1));
    EXPECT_EQ(surface("COFF 3 1 0 0 0 0 9 8 7 1 0 0 6 5 4 1 1 0 3 2 1 3 0 1 2", kOffName).colours[1],
              (Colour{6, 5, 4}));
    EXPECT_FALSE(read(kOff.substr(0, 10) + "0 0 0 1\n" + kOff.substr(10), kOffName).ok());
}

TEST(StlReader, FacetsAreWelded) {
    for (const std::string &file : {binary_stl(kTwoFacets), binary_stl(kTwoFacets, "solid though binary"), kAsciiStl}) {
        const Surface s = surface(file, kStlName);
        EXPECT_EQ(s.positions.size(), 4U);
        ASSERT_EQ(s.triangles.size(), 2U);
        EXPECT_EQ(s.triangles[1], glm::uvec3(0, 2, 3));
    }
}

TEST(StlReader, FacetsThatAreNotFiniteOrDegenerateAreCounted) {
    std::vector<std::array<float, 9>> facets = kTwoFacets;
    facets.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0, 1, 0, 0, 1, 1, 0});
    facets.push_back({0, 0, 0, 0, 0, 0, 1, 1, 0});
    const Surface s = surface(binary_stl(facets), kStlName);
    EXPECT_EQ(s.positions.size(), 4U);
    EXPECT_EQ(s.triangles.size(), 2U);
    EXPECT_EQ(s.dropped_triangles, 2U);
}

TEST(StlReader, EveryTruncationIsRefused) {
    const std::string binary = binary_stl(kTwoFacets);
    for (std::size_t size = 0; size < binary.size(); ++size)
        EXPECT_EQ(error(binary.substr(0, size), kStlName).code, ErrorCode::bad_input) << size;
    EXPECT_EQ(error(binary + std::string(50, '\0'), kStlName).code, ErrorCode::bad_input); // a facet beyond the count
    for (std::size_t size = 0; size + 1 < kAsciiStl.size(); ++size)
        EXPECT_EQ(error(kAsciiStl.substr(0, size), kStlName).code, ErrorCode::bad_input) << size;
}

TEST(StlReader, DamagedTextIsRefusedWithItsLine) {
    std::string file = kAsciiStl;
    file.replace(file.find("vertex 1 0 0"), 12, "vertex 1 z 0");
    EXPECT_TRUE(has(error(file, kStlName).message, "line 5: 'z' is not a number"));
    file = kAsciiStl;
    file.replace(file.find(" endloop"), 8, "vertex 4");
    EXPECT_TRUE(has(error(file, kStlName).message, "triangles only"));
}

TEST(StlReader, WordsMayStandOnAnyLine) {
    for (const char from : {'\n', ' '}) { // one line; a line for each word
        std::string file = kAsciiStl;
        std::replace(file.begin(), file.end(), from, from == ' ' ? '\n' : ' ');
        const Surface s = surface(file, kStlName);
        EXPECT_EQ(s.triangles, surface(kAsciiStl, kStlName).triangles);
        EXPECT_EQ(s.positions, surface(kAsciiStl, kStlName).positions);
        for (std::size_t size = 0; size < file.rfind("endsolid") + 8; ++size)
            EXPECT_FALSE(read(file.substr(0, size), kStlName).ok()) << size;
    }
    const std::string facet = " facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet";
    EXPECT_EQ(surface("solid a" + facet + "\n" + facet + " endsolid a solid b" + facet + " end solid", kStlName)
                  .dropped_triangles,
              0U);
    EXPECT_EQ(
        surface("solid a" + facet + facet + " endsolid a solid b" + facet + " end solid", kStlName).triangles.size(),
        3U);
    EXPECT_EQ(surface(kAsciiStl + "solid b" + facet + " endsolid", kStlName).triangles.size(), 3U);
    EXPECT_FALSE(read("solid a" + facet, kStlName).ok());
    EXPECT_FALSE(read("solid a" + facet + " endsolid" + facet, kStlName).ok());
}

// 15 bits of colour: in Materialise red is lowest, in VisCAM blue.
TEST(StlReader, FacetsHaveTheColoursOfTheProgramsThatWriteThem) {
    const auto coloured = [](const std::string &header, std::array<std::uint16_t, 2> attributes) {
        std::string file = binary_stl(kTwoFacets, header);
        for (std::size_t facet = 0; facet < 2; ++facet)
            std::memcpy(file.data() + 84 + 50 * facet + 48, &attributes[facet], 2);
        return surface(file, kStlName);
    };
    const std::uint16_t blue_first = 25 << 10 | 12 << 5 | 3, red_first = 3 << 10 | 12 << 5 | 25;
    const Colour expected{206, 99, 25}, object{30, 100, 200};
    const std::string header = "COLOR=\x1e\x64\xc8\xff,MATERIAL=";
    const Surface materialise = coloured(header, {red_first, 0x8000});
    EXPECT_EQ(materialise.face_colours, (std::vector<FaceColour>{{expected, true}, {object, true}}));
    EXPECT_EQ(materialise.positions.size(), 4U); // colours do not cut the mesh
    EXPECT_EQ(coloured(header, {0, 0}).face_colours, (std::vector<FaceColour>{{object, true}, {object, true}}));
    const std::uint16_t viscam = 0x8000 | blue_first;
    EXPECT_EQ(coloured("", {viscam, viscam}).face_colours,
              (std::vector<FaceColour>{{expected, true}, {expected, true}}));
    EXPECT_EQ(coloured("", {viscam, 0}).face_colours, (std::vector<FaceColour>{{expected, true}, {}}));
    const Surface other = coloured("", {viscam, red_first});
    EXPECT_TRUE(other.face_colours.empty());
    EXPECT_TRUE(reports(other, "attribute bytes", Fate::dropped));
}

TEST(SurfaceReader, TheContentDecidesBeforeTheExtension) {
    EXPECT_TRUE(read(kOff, "scan.stl").ok());
    EXPECT_TRUE(read(kOff, "scan").ok());
    EXPECT_TRUE(read(kAsciiStl, "scan").ok());
    EXPECT_TRUE(read(binary_stl(kTwoFacets), "scan").ok());
    EXPECT_TRUE(read(kObj, "scan.OBJ").ok());
    const std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
        "z\nend_header\n1 2 3\n";
    EXPECT_TRUE(read(ply, "scan.obj").ok());
}

TEST(OffReader, BinaryFilesAreRead) {
    const auto big_endian = [](const auto &values) {
        std::string out;
        for (const auto value : values) {
            const auto bits = std::bit_cast<std::uint32_t>(value);
            for (int shift = 24; shift >= 0; shift -= 8)
                out += static_cast<char>(bits >> shift & 0xFF);
        }
        return out;
    };
    using Floats = std::vector<float>;
    using Words = std::vector<std::uint32_t>;
    const std::string file = "OFF BINARY\n" + big_endian(Words{4, 2, 0}) +
                             big_endian(Floats{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0.5F}) +
                             big_endian(Words{3, 0, 1, 2, 0, 3, 0, 2, 3, 3}) + big_endian(Floats{1, 0, 0});
    const Surface s = surface(file, kOffName);
    ASSERT_EQ(s.positions.size(), 4U);
    EXPECT_EQ(s.positions[3], glm::dvec3(0, 1, 0.5));
    EXPECT_EQ(s.triangles, (std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_EQ(s.face_colours, (std::vector<pbm::build::FaceColour>{{}, {{255, 0, 0}, true}}));
    for (std::size_t size = 12; size < file.size(); ++size)
        EXPECT_EQ(error(file.substr(0, size), kOffName).code, ErrorCode::bad_input) << size;
    EXPECT_TRUE(has(error(file + std::string(8, '\0'), kOffName).message, "after the last face"));
    EXPECT_EQ(report(surface(file + "x", kOffName), "end of file").note, "1 byte behind the last face");
    std::string beyond = file;
    beyond[11 + 12 + 48 + 7] = 9;
    EXPECT_TRUE(has(error(beyond, kOffName).message, "face 0 has vertex index 9"));
}

// Files of pigz, gzip, bgzip and zstd consist of one part or several.
// However long it is: unpacking looks at the flag at each step.
TEST(SurfaceReader, UnpackingIsCancelled) {
    const std::string text(100, 'x');
    std::string packed(ZSTD_compressBound(text.size()), '\0');
    packed.resize(ZSTD_compress(packed.data(), packed.size(), text.data(), text.size(), 3));
    const std::span bytes(reinterpret_cast<const std::uint8_t *>(packed.data()), packed.size());
    std::atomic<bool> cancelled = false;
    const pbm::CancellationScope scope(&cancelled);
    const auto whole = pbm::build::unpacked(bytes, 1000);
    ASSERT_TRUE(whole && *whole);
    EXPECT_EQ((*whole)->size(), text.size());
    cancelled = true;
    EXPECT_THROW(static_cast<void>(pbm::build::unpacked(bytes, 1000)), pbm::Cancelled);
}

TEST(SurfaceReader, CompressedFilesAreUnpacked) {
    const auto packed = [](const std::string &text) {
        z_stream stream{};
        EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
        std::string out(text.size() + 100, '\0'), in = text;
        stream.next_in = reinterpret_cast<Bytef *>(in.data());
        stream.avail_in = static_cast<uInt>(in.size());
        stream.next_out = reinterpret_cast<Bytef *>(out.data());
        stream.avail_out = static_cast<uInt>(out.size());
        EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
        out.resize(stream.total_out);
        deflateEnd(&stream);
        return out;
    };
    const auto zstd = [](const std::string &text) {
        std::string out(ZSTD_compressBound(text.size()), '\0');
        out.resize(ZSTD_compress(out.data(), out.size(), text.data(), text.size(), 3));
        return out;
    };
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "pbm_compressed";
    std::filesystem::create_directories(folder);
    const auto read = [&](const std::string &name, const std::string &contents) {
        std::ofstream(folder / name, std::ios::binary) << contents;
        return pbm::build::read_surface((folder / name).string(), {});
    };
    const std::string first = kObj.substr(0, 9), second = kObj.substr(9);
    for (const auto &[name, contents] : {std::pair<std::string, std::string>("a.obj.gz", packed(kObj)),
                                         {"b.obj.gz", packed(first) + packed(second)},
                                         {"c.obj.zst", zstd(kObj)},
                                         {"d.obj.zst", zstd(first) + zstd(second)},
                                         {"e.OFF.GZ", packed(kOff)},
                                         {"f.off", zstd(kOff)}}) {
        const Result<Surface> s = read(name, contents);
        ASSERT_TRUE(s.ok()) << name << ": " << s.error().message;
        EXPECT_EQ(s->triangles.size(), 2U) << name;
        EXPECT_EQ(s->input_bytes, contents.size());
        for (std::size_t size = 4; size < contents.size(); ++size)
            EXPECT_FALSE(read(name, contents.substr(0, size)).ok()) << name << ", " << size;
        EXPECT_FALSE(read(name, contents + "x").ok()) << name;
    }
    EXPECT_TRUE(has(read("g.obj.gz", packed(packed(kObj))).error().message, "gzip twice"));
    const Result<Surface> bomb = read("h.obj.gz", packed(std::string(std::size_t{80} << 20, ' ')));
    ASSERT_FALSE(bomb.ok());
    EXPECT_EQ(bomb.error().code, ErrorCode::memory);
    EXPECT_TRUE(has(bomb.error().message, "64 MiB when unpacked")) << bomb.error().message;
    std::filesystem::remove_all(folder);
}

TEST(SurfaceReader, OtherFormatsAreNamed) {
    EXPECT_TRUE(has(error("P4\n8 8\n", "x.pbm").message, "Netpbm bitmap"));
    EXPECT_TRUE(has(error("Kaydara FBX Binary", "x.fbx").message, "FBX; convert it to PLY"));
    EXPECT_TRUE(has(error("{}", "x.gltf").message, "no glTF file"));
    EXPECT_TRUE(has(error("DRACO", "x.drc").message, "Draco"));
    EXPECT_TRUE(has(error("\x1f\x8b\x08", "x.ply.gz").message, "gzip"));
    EXPECT_TRUE(has(error("BZh9", "x.ply.bz2").message, "bzip2"));
    EXPECT_TRUE(has(error("\x89"
                          "BVG\r\n\x1a\n",
                          "x.pbvg")
                        .message,
                    "pbm-render"));
    EXPECT_EQ(error("DRACO", "x.drc").code, ErrorCode::unsupported_feature);
    EXPECT_EQ(error("", "x.ply").message, "the file is empty");
    EXPECT_EQ(error("hello", "x").code, ErrorCode::bad_input);
    EXPECT_TRUE(has(error("hello", "x.ply").message, "not a PLY file"));
}

TEST(SurfaceReader, TheSystemsErrorsAreNamed) {
    const Result<Surface> missing = pbm::build::read_surface("/no/such/file.ply", {});
    ASSERT_FALSE(missing.ok());
    EXPECT_EQ(missing.error().code, ErrorCode::io);
    EXPECT_TRUE(has(missing.error().message, "No such file"));
    EXPECT_FALSE(has(missing.error().message, "/no/such"));
    const Result<Surface> folder = pbm::build::read_surface("/", {});
    ASSERT_FALSE(folder.ok());
    EXPECT_EQ(folder.error().message, "cannot open: this is a folder");
}

TEST(SurfaceReader, AMaterialFileOfManySpellingsIsNotReadForEach) {
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "pbm_many_spellings";
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "skin.mtl") << "map_Kd skin.png\n";
    std::ofstream obj(folder / "scan.obj");
    constexpr int kSpellings = 1000;
    for (int i = 1; i <= kSpellings; ++i)
        obj << "mtllib " << std::string(static_cast<std::size_t>(i), '/') << "skin.mtl\n";
    obj.close();
    const std::vector<pbm::build::NamedFile> named = pbm::build::further_files((folder / "scan.obj").string());
    constexpr std::size_t kLookedFor = 64;
    EXPECT_EQ(named.size(), kLookedFor);
    for (const pbm::build::NamedFile &file : named)
        EXPECT_EQ(file.file, (folder / "skin.mtl").string());
    std::filesystem::remove_all(folder);
}

} // namespace
