#include "unit/scan/ply_files.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace pbm::test;
using pbm::Error;
using pbm::ErrorCode;
using pbm::Result;
using pbm::build::ReadOptions;
using pbm::build::Surface;
using Colour = std::array<std::uint8_t, 3>;

TEST(PlyBody, AnAsciiTriangleIsRead) {
    const Surface s = surface(kTriangle);
    ASSERT_EQ(s.positions.size(), 3U);
    EXPECT_EQ(s.positions[2], glm::dvec3(0, 1.5, -0.2));
    ASSERT_EQ(s.triangles.size(), 1U);
    EXPECT_EQ(s.triangles[0], glm::uvec3(0, 1, 2));
    EXPECT_TRUE(s.normals.empty() && s.colours.empty() && s.radii.empty() && s.material_ids.empty());
    ASSERT_EQ(s.report.size(), 2U);
    EXPECT_EQ(s.report[0].name, "vertex.x y z");
    EXPECT_EQ(s.report[0].fate, Fate::kept);
    EXPECT_EQ(s.report[1].name, "face.vertex_indices");
}

TEST(PlyBody, BothByteOrdersGiveTheSame) {
    for (const bool big_endian : {false, true}) {
        const Surface s = surface(binary_square(big_endian));
        ASSERT_EQ(s.positions.size(), 4U);
        EXPECT_EQ(s.positions[2], glm::dvec3(1, 2.5, 0.25));
        EXPECT_EQ(s.normals[3], glm::vec3(0, 0, 1));
        EXPECT_EQ(s.colours[1], (Colour{10, 200, 13}));
        ASSERT_EQ(s.triangles.size(), 2U);
        EXPECT_EQ(s.triangles[1], glm::uvec3(0, 2, 3));
    }
}

TEST(PlyBody, EveryScalarTypeIsReadInEveryEncoding) {
    const std::vector<std::array<const char *, 2>> names = {
        {"char", "int8"}, {"uchar", "uint8"}, {"short", "int16"},   {"ushort", "uint16"},
        {"int", "int32"}, {"uint", "uint32"}, {"float", "float32"}, {"double", "float64"}};
    for (std::size_t type = 0; type < names.size(); ++type)
        for (const char *name : names[type])
            for (const bool big_endian : {false, true}) {
                std::string file = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                                   "_endian 1.0\nelement vertex 1\n" + replaced(kXyz, "float", name) + "end_header\n";
                for (const int value : {7, 100, 3})
                    switch (type) {
                    case 0: put(file, static_cast<std::int8_t>(value), big_endian); break;
                    case 1: put(file, static_cast<std::uint8_t>(value), big_endian); break;
                    case 2: put(file, static_cast<std::int16_t>(value), big_endian); break;
                    case 3: put(file, static_cast<std::uint16_t>(value), big_endian); break;
                    case 4: put(file, static_cast<std::int32_t>(value), big_endian); break;
                    case 5: put(file, static_cast<std::uint32_t>(value), big_endian); break;
                    case 6: put(file, static_cast<float>(value), big_endian); break;
                    default: put(file, static_cast<double>(value), big_endian); break;
                    }
                EXPECT_EQ(surface(file).positions[0], glm::dvec3(7, 100, 3)) << name;
                const std::string ascii = "ply\nformat ascii 1.0\nelement vertex 1\n" + replaced(kXyz, "float", name) +
                                          "end_header\n7 100 3\n";
                EXPECT_EQ(surface(ascii).positions[0], glm::dvec3(7, 100, 3)) << name;
            }
}

TEST(PlyBody, DoublesKeepTheirPrecision) {
    const std::string file = replaced(kTriangle, "1 0 0\n", "8500000.0009765625 4512345678901234567 1e-300\n");
    EXPECT_EQ(surface(file).positions[1], glm::dvec3(8500000.0009765625, 4512345678901234567.0, 1e-300));
}

TEST(PlyBody, AsciiNumbersAreCorrectlyRounded) {
    std::mt19937_64 random(7);
    std::string rows;
    std::vector<double> expected;
    for (int i = 0; i < 3000; ++i) {
        std::array<char, 40> text{};
        const double value =
            std::ldexp(static_cast<double>(random() >> 11) - 4e15, static_cast<int>(random() % 80) - 60);
        std::snprintf(text.data(), text.size(), "%.*g", static_cast<int>(random() % 17) + 1, value);
        expected.push_back(std::strtod(text.data(), nullptr));
        rows += std::string(text.data()) + (i % 3 == 2 ? "\n" : " ");
    }
    const Surface s = surface("ply\nformat ascii 1.0\nelement vertex 1000\n" + kXyz + "end_header\n" + rows);
    ASSERT_EQ(s.positions.size(), 1000U);
    for (std::size_t i = 0; i < expected.size(); ++i)
        EXPECT_EQ(s.positions[i / 3][static_cast<int>(i % 3)], expected[i]);
}

TEST(PlyBody, OrderOfElementsAndPropertiesIsFree) {
    const std::string file = "ply\nformat ascii 1.0\nelement face 1\nproperty uchar flags\nproperty list uchar int "
                             "vertex_index\nelement vertex 3\nproperty float z\nproperty uchar blue\nproperty float "
                             "x\nproperty uchar red\nproperty float y\nproperty uchar green\nend_header\n"
                             "9 3 2 1 0\n1 30 2 10 3 20\n4 30 5 10 6 20\n7 30 8 10 9 20\n";
    const Surface s = surface(file);
    EXPECT_EQ(s.positions[0], glm::dvec3(2, 3, 1));
    EXPECT_EQ(s.colours[2], (Colour{10, 20, 30}));
    EXPECT_EQ(s.triangles[0], glm::uvec3(2, 1, 0));
    EXPECT_EQ(report(s, "face.flags").fate, Fate::dropped);
}

TEST(PlyBody, ListsAndUnknownElementsAreSkippedByTheirSize) {
    for (const bool big_endian : {false, true}) {
        std::string file =
            std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
            "_endian 1.0\nelement junk 2\nproperty double a\nproperty list ushort short b\nelement vertex "
            "3\nproperty list uchar double weights\n" +
            kXyz +
            "element empty 1000000\nelement face 1\nproperty list int uint vertex_indices\n"
            "property list uchar float texcoord\nend_header\n";
        for (int i = 0; i < 2; ++i) {
            put(file, 1.0, big_endian);
            put(file, std::uint16_t{2}, big_endian);
            put(file, std::int32_t{}, big_endian); // two shorts
        }
        for (int i = 0; i < 3; ++i) {
            file += '\1';
            put(file, 1.0, big_endian);
            for (const float value : {0.F, 1.F, static_cast<float>(i)})
                put(file, value, big_endian);
        }
        for (const std::uint32_t value : {3U, 2U, 1U, 0U})
            put(file, value, big_endian);
        file += '\0';
        const Surface s = surface(file);
        ASSERT_EQ(s.positions.size(), 3U);
        EXPECT_EQ(s.positions[2], glm::dvec3(0, 1, 2));
        EXPECT_EQ(s.triangles[0], glm::uvec3(2, 1, 0));
        EXPECT_EQ(report(s, "element 'junk'").fate, Fate::dropped);
        EXPECT_EQ(report(s, "vertex.weights").fate, Fate::dropped);
        EXPECT_TRUE(has(report(s, "face.texcoord").note, "texture"));
    }
}

const std::string kPolygons = "ply\nformat ascii 1.0\nelement vertex 5\n" + kXyz +
                              "element face 6\nproperty list uchar int vertex_indices\nend_header\n"
                              "0 0 0\n2 0 0\n3 2 0\n1 4 0\n-1 2 0\n"
                              "3 0 1 2\n5 4 3 2 1 0\n4 0 1 1 2\n2 0 1\n0\n3 1 1 1\n";

TEST(PlyBody, ConvexPolygonsAreFannedAndDegenerateOnesCounted) {
    const Surface s = surface(kPolygons);
    EXPECT_EQ(s.triangles, (std::vector<glm::uvec3>{{0, 1, 2}, {4, 3, 2}, {4, 2, 1}, {4, 1, 0}, {0, 1, 2}}));
    EXPECT_EQ(s.dropped_triangles, 1U + 1U + 1U + 1U);
}

TEST(PlyBody, FacesInFrontOfTheVerticesGiveTheSameTriangles) {
    std::string file = replaced(kPolygons, "4 0 1 1 2\n", "5 0 1 2 4 3\n"); // concave
    const Surface behind = surface(file);
    file = replaced(file, "element face 6\nproperty list uchar int vertex_indices\n", "");
    file = replaced(file, "element vertex", "element face 6\nproperty list uchar int vertex_indices\nelement vertex");
    const std::size_t rows = file.find("0 0 0\n"), faces = file.find("3 0 1 2\n");
    file = file.substr(0, rows) + file.substr(faces) + file.substr(rows, faces - rows);
    const Surface before = surface(file);
    EXPECT_EQ(before.triangles, behind.triangles);
    EXPECT_EQ(before.triangles.size(), 1U + 3U + 3U);
    EXPECT_EQ(before.dropped_triangles, behind.dropped_triangles);
    EXPECT_EQ(before.dropped_triangles, 3U);
}

TEST(PlyBody, AConcavePolygonIsNotFannedOverItsNotch) {
    const Surface s = surface("ply\nformat ascii 1.0\nelement vertex 5\n" + kXyz +
                              "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                              "0 0 0\n4 0 0\n4 4 0\n2 1 0\n0 4 0\n5 2 3 4 0 1\n");
    double area = 0;
    for (const glm::uvec3 t : s.triangles) {
        const glm::dvec3 u = s.positions[t.y] - s.positions[t.x], v = s.positions[t.z] - s.positions[t.x];
        EXPECT_GT(u.x * v.y - u.y * v.x, 0.0);
        area += 0.5 * (u.x * v.y - u.y * v.x);
    }
    EXPECT_EQ(s.triangles.size(), 3U);
    EXPECT_DOUBLE_EQ(area, 16.0 - 6.0);
}

TEST(PlyBody, StripsAreUnrolledWithAlternateWinding) {
    const std::string head = "ply\nformat ascii 1.0\nelement vertex 5\n" + kXyz +
                             "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
                             "0 0 0\n1 0 0\n2 0 0\n3 0 0\n4 0 0\n";
    const Surface s = surface(head + "9 0 1 2 3 -1 2 3 4 -1\n");
    ASSERT_EQ(s.triangles.size(), 3U);
    EXPECT_EQ(s.triangles[0], glm::uvec3(0, 1, 2));
    EXPECT_EQ(s.triangles[1], glm::uvec3(2, 1, 3));
    EXPECT_EQ(s.triangles[2], glm::uvec3(2, 3, 4));
    EXPECT_EQ(surface(head + "6 0 1 2 2 3 4\n").dropped_triangles, 0U); // equal corners only turn the strip
    EXPECT_TRUE(has(error(head + "3 0 1 -2\n").message, "vertex index -2"));
    EXPECT_TRUE(has(error(head + "3 0 1 5\n").message, "vertex index 5"));
}

TEST(PlyBody, VerticesThatAreNotFiniteGoWithTheirTriangles) {
    for (const char *bad : {"nan", "inf", "-inf", "1e999", "-NaN", "Infinity"}) {
        std::string file = replaced(kTriangle, "element vertex 3", "element vertex 4");
        file = replaced(file, "0 0 0\n", std::string("0 ") + bad + " 0\n9 9 9\n");
        file = replaced(file, "element face 1", "element face 2") + "3 3 2 1\n";
        const Surface s = surface(file);
        ASSERT_EQ(s.positions.size(), 3U) << bad;
        EXPECT_EQ(s.positions[0], glm::dvec3(9, 9, 9));
        EXPECT_EQ(s.dropped_vertices, 1U);
        EXPECT_EQ(s.dropped_triangles, 1U);
        ASSERT_EQ(s.triangles.size(), 1U);
        EXPECT_EQ(s.triangles[0], glm::uvec3(2, 1, 0));
    }
    EXPECT_TRUE(
        has(error("ply\nformat ascii 1.0\nelement vertex 1\n" + kXyz + "end_header\nnan 0 0\n").message, "finite"));
}

// 3 columns, 2 rows; the last cell is empty.
const std::string kRangeGrid = "ply\nformat ascii 1.0\nobj_info num_cols 3\nobj_info num_rows 2\nelement vertex 5\n" +
                               kXyz +
                               "element range_grid 6\nproperty list uchar int vertex_indices\nend_header\n"
                               "0 0 0\n1 0 0\n2 0 0\n0 1 0\n1 1 0\n1 0\n1 1\n1 2\n1 3\n1 4\n0\n";

TEST(PlyBody, RangeImagesBecomeTriangles) {
    const Surface s = surface(kRangeGrid);
    EXPECT_EQ(s.positions.size(), 5U);
    EXPECT_EQ(s.triangles, (std::vector<glm::uvec3>{{0, 1, 4}, {0, 4, 3}, {1, 2, 4}}));
    EXPECT_EQ(report(s, "range_grid.vertex_indices").fate, Fate::converted);
    EXPECT_TRUE(has(report(s, "range_grid.vertex_indices").note, "3 x 2"));
}

TEST(PlyBody, RangeImagesOfUnknownSizeKeepTheirPoints) {
    for (const char *line :
         {"obj_info num_cols 4\n", "obj_info num_cols 0\n", "obj_info num_cols\n", "obj_info num_cols x\n", ""}) {
        const Surface s = surface(replaced(kRangeGrid, "obj_info num_cols 3\n", line));
        EXPECT_EQ(s.positions.size(), 5U);
        EXPECT_TRUE(s.triangles.empty());
        EXPECT_TRUE(has(report(s, "element 'range_grid'").note, "num_cols")) << line;
        EXPECT_EQ(report(s, "end of file").name, "");
    }
}

TEST(PlyBody, FacesGoBeforeARangeImage) {
    const std::string face = "element face 1\nproperty list uchar int vertex_indices\nend_header";
    const Surface s = surface(replaced(kRangeGrid, "end_header", face) + "3 0 1 3\n");
    EXPECT_EQ(s.triangles, (std::vector<glm::uvec3>{{0, 1, 3}}));
    EXPECT_TRUE(has(report(s, "element 'range_grid'").note, "faces of its own"));
}

TEST(PlyBody, ACellOfARangeImageHoldsOneVertexAtMost) {
    const Error e = error(replaced(kRangeGrid, "1 2\n", "2 2 3\n"));
    EXPECT_TRUE(has(e.message, "line 19: range_grid 2, vertex_indices: a cell")) << e.message;
    EXPECT_TRUE(
        has(error(replaced(kRangeGrid, "1 4\n", "1 5\n")).message, "range_grid 4, vertex_indices: vertex index 5"));
}

TEST(PlyBody, ProgressNeverFallsAndStaysInBounds) {
    double last = 0;
    int calls = 0;
    ReadOptions options;
    options.progress = [&](double done) {
        EXPECT_GE(done, last);
        EXPECT_LE(done, 1.0);
        last = done;
        ++calls;
    };
    std::string file = "ply\nformat ascii 1.0\nelement vertex 200000\n" + kXyz + "end_header\n";
    for (int i = 0; i < 200000; ++i)
        file += "0 0 0\n";
    EXPECT_TRUE(read(file, options).ok());
    EXPECT_GE(calls, 3);
}

} // namespace
