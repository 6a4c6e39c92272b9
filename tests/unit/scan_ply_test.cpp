#include "pbm_scan/ply_reader.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace {

using pbm::Error;
using pbm::ErrorCode;
using pbm::Result;
using pbm::build::AttributeReport;
using pbm::build::ReadOptions;
using pbm::build::Surface;
using Fate = AttributeReport::Fate;
using Colour = std::array<std::uint8_t, 3>;

Result<Surface> read(const std::string &text, const ReadOptions &options = {}) {
    return pbm::build::read_ply({reinterpret_cast<const std::uint8_t *>(text.data()), text.size()}, options);
}

Surface surface(const std::string &text) {
    Result<Surface> result = read(text);
    EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
    return result.ok() ? std::move(*result) : Surface{};
}

Error error(const std::string &text, const ReadOptions &options = {}) {
    const Result<Surface> result = read(text, options);
    EXPECT_FALSE(result.ok());
    return result.ok() ? Error{} : result.error();
}

// The line of the report whose name begins with `name`; an empty one where there is none.
AttributeReport report(const Surface &s, std::string_view name) {
    for (const AttributeReport &line : s.report)
        if (line.name.substr(0, name.size()) == name)
            return line;
    return {};
}

bool has(const std::string &text, std::string_view part) { return text.find(part) != std::string::npos; }

std::string replaced(std::string text, std::string_view from, std::string_view to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

// Appends `value` as a binary file holds it.
template <class T> void put(std::string &out, T value, bool big_endian) {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &value, sizeof value);
    const bool swap = big_endian == (std::endian::native == std::endian::little);
    for (std::size_t i = 0; i < bytes.size(); ++i)
        out += bytes[swap ? bytes.size() - 1 - i : i];
}

const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";

const std::string kTriangle = "ply\nformat ascii 1.0\nelement vertex 3\n" + kXyz +
                              "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                              "0 0 0\n1 0 0\n0 1.5 -2e-1\n3 0 1 2\n";

// Two triangles over four vertices, normals and colours.
std::string binary_square(bool big_endian) {
    std::string out =
        std::string("ply\nformat ") + (big_endian ? "binary_big_endian" : "binary_little_endian") +
        " 1.0\nelement vertex 4\n" + kXyz +
        "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar "
        "green\nproperty uchar blue\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";
    for (const auto &[x, y] : {std::array{0.F, 0.F}, {1.F, 0.F}, {1.F, 2.5F}, {0.F, 2.5F}}) {
        for (const float value : {x, y, 0.25F, 0.F, 0.F, 1.F})
            put(out, value, big_endian);
        out += "\x0a\xc8\x0d"; // colours that look like line ends
    }
    for (const std::array<std::int32_t, 3> &face : {std::array{0, 1, 2}, {0, 2, 3}}) {
        out += '\3';
        for (const std::int32_t corner : face)
            put(out, corner, big_endian);
    }
    return out;
}

TEST(PlyReader, AnAsciiTriangleIsRead) {
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

TEST(PlyReader, BothByteOrdersGiveTheSame) {
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

TEST(PlyReader, EveryTruncationOfABinaryFileIsRefused) {
    for (const bool big_endian : {false, true}) {
        const std::string whole = binary_square(big_endian);
        for (std::size_t size = 0; size < whole.size(); ++size) {
            const Error e = error(whole.substr(0, size));
            EXPECT_EQ(e.code, ErrorCode::bad_input) << size;
            EXPECT_LE(e.offset, size);
            EXPECT_FALSE(has(e.message, "\n"));
        }
    }
}

TEST(PlyReader, EveryTruncationOfAnAsciiFileIsRefusedDownToTheLastNumber) {
    const std::size_t last_number = kTriangle.size() - 2; // "2\n"; without the line end it is whole
    for (std::size_t size = 0; size <= last_number; ++size)
        EXPECT_EQ(error(kTriangle.substr(0, size)).code, ErrorCode::bad_input) << size;
    EXPECT_TRUE(read(kTriangle.substr(0, last_number + 1)).ok());
}

TEST(PlyReader, LineEndsMayBeCrLfOrCr) {
    for (const char *end : {"\r\n", "\r"}) {
        const Surface s = surface(replaced(kTriangle, "\n", end));
        EXPECT_EQ(s.positions.size(), 3U);
        EXPECT_EQ(s.triangles.size(), 1U);
    }
    const std::string binary = binary_square(false);
    const std::size_t body = binary.find("end_header\n") + 11;
    for (const char *end : {"\r\n", "\r"})
        EXPECT_EQ(surface(replaced(binary.substr(0, body), "\n", end) + binary.substr(body)).triangles.size(), 2U);
}

TEST(PlyReader, ABinaryBodyMayBeginWithALineEnd) {
    for (const char first : {'\n', '\r'}) {
        std::string file = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar "
                           "y\nproperty uchar z\nend_header\n";
        file += {first, 5, 6};
        EXPECT_EQ(surface(file).positions[0], glm::dvec3(first, 5, 6));
    }
}

TEST(PlyReader, AHeaderWithOnlyCrKeepsALfThatBelongsToTheBody) {
    std::string file = "ply\rformat binary_little_endian 1.0\relement vertex 1\rproperty uchar x\rproperty uchar "
                       "y\rproperty uchar z\rend_header\r";
    file += {'\n', 5, 6};
    EXPECT_EQ(surface(file).positions[0], glm::dvec3(10, 5, 6));
}

TEST(PlyReader, CommentsStandAnywhereAlsoAsTheLastHeaderLine) {
    std::string file = replaced(kTriangle, "element", "comment element vertex 9\nobj_info num_cols 512\nelement");
    file = replaced(file, "end_header", "comment\nobj_info last\ncomment end_header\nend_header");
    file = replaced(file, "ply\n", "ply\ncomment before the format\n");
    EXPECT_EQ(surface(file).triangles.size(), 1U);
}

TEST(PlyReader, WhiteSpaceIsFree) {
    std::string file = replaced(kTriangle, "element vertex 3", "  element \t vertex   3  ");
    file = replaced(file, "1 0 0\n", "\n  1\t0   0  \n\n");
    EXPECT_EQ(surface(file).positions[1], glm::dvec3(1, 0, 0));
}

TEST(PlyReader, EveryScalarTypeIsReadInEveryEncoding) {
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

TEST(PlyReader, DoublesKeepTheirPrecision) {
    const std::string file = replaced(kTriangle, "1 0 0\n", "8500000.0009765625 4512345678901234567 1e-300\n");
    EXPECT_EQ(surface(file).positions[1], glm::dvec3(8500000.0009765625, 4512345678901234567.0, 1e-300));
}

TEST(PlyReader, AsciiNumbersAreCorrectlyRounded) {
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

TEST(PlyReader, OrderOfElementsAndPropertiesIsFree) {
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

TEST(PlyReader, ListsAndUnknownElementsAreSkippedByTheirSize) {
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

TEST(PlyReader, PolygonsAreFannedAndDegenerateOnesCounted) {
    std::string file = replaced(kTriangle, "element face 1", "element face 6");
    file = replaced(file, "element vertex 3", "element vertex 5");
    file = replaced(file, "0 0 0\n", "0 0 0\n5 5 5\n6 6 6\n");
    const Surface s = surface(file + "5 4 3 2 1 0\n4 0 1 1 2\n2 0 1\n0\n3 1 1 1\n");
    EXPECT_EQ(s.triangles.size(), 1U + 3U + 1U);
    EXPECT_EQ(s.triangles[1], glm::uvec3(4, 3, 2));
    EXPECT_EQ(s.triangles[3], glm::uvec3(4, 1, 0));
    EXPECT_EQ(s.dropped_triangles, 1U + 1U + 1U + 1U);
}

TEST(PlyReader, StripsAreUnrolledWithAlternateWinding) {
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

TEST(PlyReader, ColoursComeInEverySpellingAndRange) {
    const auto colour_file = [](const std::string &type, const std::string &names, const std::string &values) {
        std::string file = "ply\nformat ascii 1.0\nelement vertex 2\n" + kXyz;
        for (std::size_t at = 0; at < names.size();) {
            const std::size_t end = std::min(names.find(' ', at), names.size());
            file += "property " + type + " " + names.substr(at, end - at) + "\n";
            at = end + 1;
        }
        return file + "end_header\n0 0 0 " + values + "\n1 1 1 0 0 0\n";
    };
    const Colour expected{255, 128, 0};
    EXPECT_EQ(surface(colour_file("uchar", "red green blue", "255 128 0")).colours[0], expected);
    EXPECT_EQ(surface(colour_file("uchar", "r g b", "255 128 0")).colours[0], expected);
    EXPECT_EQ(surface(colour_file("uint8", "diffuse_red diffuse_green diffuse_blue", "255 128 0")).colours[0],
              expected);
    EXPECT_EQ(surface(colour_file("ushort", "red green blue", "65535 32896 0")).colours[0], expected);
    EXPECT_EQ(surface(colour_file("ushort", "red green blue", "255 128 0")).colours[0], expected);
    EXPECT_EQ(surface(colour_file("float", "red green blue", "1.0 0.502 0")).colours[0], expected);
    EXPECT_EQ(surface(colour_file("float", "red green blue", "255.0 128.0 -3")).colours[0], expected);
    EXPECT_EQ(surface(colour_file("double", "red green blue", "1 0.502 nan")).colours[0], expected);
    EXPECT_EQ(surface(colour_file("int", "red green blue", "255 128 0")).colours[0], expected);
    EXPECT_EQ(surface(colour_file("char", "red green blue", "-1 -128 0")).colours[0], expected);
    EXPECT_EQ(report(surface(colour_file("float", "r g b", "1 0.5 0")), "vertex.r g b").fate, Fate::converted);
    EXPECT_EQ(report(surface(colour_file("float", "r g b", "1e9 0.5 0")), "vertex.r g b").fate, Fate::dropped);
    EXPECT_TRUE(surface(colour_file("uchar", "red green other", "1 2 3")).colours.empty());
}

TEST(PlyReader, ColoursOfFacesBecomeTheMeanAtTheirVertices) {
    const std::string head = "ply\nformat ascii 1.0\nelement vertex 4\n" + kXyz;
    const std::string face =
        "element face 2\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty uchar "
        "green\nproperty uchar blue\nproperty uchar alpha\nend_header\n";
    const Surface s = surface(head + face + "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 100 0 0 255\n3 0 2 3 200 10 0 255\n");
    ASSERT_EQ(s.colours.size(), 4U);
    EXPECT_EQ(s.colours[0], (Colour{150, 5, 0}));
    EXPECT_EQ(s.colours[1], (Colour{100, 0, 0}));
    EXPECT_EQ(s.colours[3], (Colour{200, 10, 0}));
    EXPECT_EQ(report(s, "face.red green blue").fate, Fate::converted);
    EXPECT_EQ(report(s, "face.alpha").fate, Fate::dropped);

    const std::string own = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    const Surface kept = surface(head + own + face +
                                 "0 0 0 1 2 3\n1 0 0 1 2 3\n1 1 0 1 2 3\n0 1 0 1 2 3\n"
                                 "3 0 1 2 100 0 0 255\n3 0 2 3 200 10 0 255\n");
    EXPECT_EQ(kept.colours[0], (Colour{1, 2, 3}));
    EXPECT_EQ(report(kept, "face.red green blue").fate, Fate::dropped);
}

const std::string kMaterials = "ply\nformat ascii 1.0\nelement vertex 2\n" + kXyz +
                               "property uchar material_index\nelement material 2\nproperty float ka\nproperty float "
                               "kd\nproperty float ks\nproperty float power\nproperty float clr_r\nproperty float "
                               "clr_g\nproperty float clr_b\nproperty float envmapfactor\nend_header\n";

TEST(PlyReader, MaterialsOfTheDissertationAreRead) {
    const Surface s = surface(kMaterials + "0 0 0 1\n1 1 1 0\n0.1 0.5 0.4 20 255 128 0 0.25\n0.2 0.8 0 1 10 20 30 0\n");
    ASSERT_EQ(s.materials.size(), 2U);
    EXPECT_FLOAT_EQ(s.materials[0].kd, 0.5F);
    EXPECT_FLOAT_EQ(s.materials[0].power, 20.0F);
    EXPECT_FLOAT_EQ(s.materials[0].environment, 0.25F);
    EXPECT_EQ(s.materials[0].colour, (Colour{255, 128, 0}));
    EXPECT_EQ(s.material_ids, (std::vector<std::uint8_t>{1, 0}));
    const Surface unit = surface(kMaterials + "0 0 0 1\n1 1 1 0\n0 0 0 1 1 0.5 0 0\n0 0 0 1 0 0 1 0\n");
    EXPECT_EQ(unit.materials[0].colour, (Colour{255, 128, 0}));
}

TEST(PlyReader, ImpossibleMaterialsAreRefused) {
    EXPECT_TRUE(has(error(kMaterials + "0 0 0 2\n1 1 1 0\n0 0 0 1 1 1 1 0\n0 0 0 1 1 1 1 0\n").message, "material 2"));
    EXPECT_TRUE(
        has(error(kMaterials + "0 0 0 0\n1 1 1 0\n0 0 0 1 1 1 1 0\n0 0 0 1 1 1 1 7\n").message, "envmapfactor"));
    EXPECT_TRUE(has(error(kMaterials + "0 0 0 0\n1 1 1 0\n-1 0 0 1 1 1 1 0\n0 0 0 1 1 1 1 0\n").message, "ka"));
    std::string nine = replaced(kMaterials, "element material 2", "element material 9") + "0 0 0 1\n1 1 1 0\n";
    for (int i = 0; i < 9; ++i)
        nine += "0.1 0.5 0.4 20 255 128 0 0\n";
    EXPECT_EQ(error(nine).code, ErrorCode::too_large);
}

TEST(PlyReader, AMaterialIndexWithoutMaterialsIsDropped) {
    const Surface s = surface("ply\nformat ascii 1.0\nelement vertex 1\n" + kXyz +
                              "property int material_index\nend_header\n1 2 3 4\n");
    EXPECT_TRUE(s.material_ids.empty());
    EXPECT_EQ(report(s, "vertex.material_index").fate, Fate::dropped);
}

TEST(PlyReader, RadiiMustBePositive) {
    const std::string head = "ply\nformat ascii 1.0\nelement vertex 2\n" + kXyz + "property float radius\nend_header\n";
    EXPECT_EQ(surface(head + "0 0 0 0.5\n1 1 1 2\n").radii, (std::vector<float>{0.5F, 2.0F}));
    const Surface s = surface(head + "0 0 0 0.5\n1 1 1 0\n");
    EXPECT_TRUE(s.radii.empty());
    EXPECT_EQ(report(s, "vertex.radius").fate, Fate::dropped);
}

TEST(PlyReader, NormalsThatAreNotFiniteHaveNoLength) {
    const std::string head = "ply\nformat ascii 1.0\nelement vertex 2\n" + kXyz +
                             "property float normal_x\nproperty float normal_y\nproperty float normal_z\nend_header\n";
    const Surface s = surface(head + "0 0 0 0 0 2\n1 1 1 nan 0 1\n");
    EXPECT_EQ(s.normals[0], glm::vec3(0, 0, 2));
    EXPECT_EQ(s.normals[1], glm::vec3(0));
    EXPECT_TRUE(surface(head + "0 0 0 0 0 0\n1 1 1 0 0 0\n").normals.empty());
}

TEST(PlyReader, VerticesThatAreNotFiniteGoWithTheirTriangles) {
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

TEST(PlyReader, CountsThatLieAreRefusedBeforeAnythingIsAllocated) {
    for (const char *count : {"4", "100", "4294967295", "18446744073709551615"}) {
        const Error e = error(replaced(kTriangle, "element vertex 3", std::string("element vertex ") + count));
        EXPECT_EQ(e.code, ErrorCode::bad_input) << count;
        EXPECT_EQ(error(replaced(binary_square(false), "element face 2", std::string("element face ") + count)).code,
                  ErrorCode::bad_input);
    }
    EXPECT_TRUE(has(error(replaced(kTriangle, "vertex 3", "vertex 99999999999999999999")).message, "impossible count"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "vertex 3", "vertex -1")).message, "impossible count"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "vertex 3", "vertex 3.5")).message, "impossible count"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "vertex 3", "vertex")).message, "expected"));
    EXPECT_EQ(error(replaced(kTriangle, "vertex 3", "vertex 0")).code, ErrorCode::bad_input);
}

TEST(PlyReader, AListThatLiesAboutItsLengthIsRefused) {
    EXPECT_EQ(error(replaced(kTriangle, "3 0 1 2\n", "200 0 1 2\n")).code, ErrorCode::bad_input);
    EXPECT_EQ(error(replaced(replaced(kTriangle, "uchar int", "int int"), "3 0 1 2\n", "-3 0 1 2\n")).code,
              ErrorCode::bad_input);
    EXPECT_EQ(error(replaced(replaced(kTriangle, "uchar int", "float int"), "3 0 1 2\n", "2.5 0 1 2\n")).code,
              ErrorCode::bad_input);
    EXPECT_EQ(surface(replaced(kTriangle, "uchar int", "float int")).triangles.size(), 1U);
    std::string binary = binary_square(false);
    binary[binary.size() - 13] = '\xff';
    EXPECT_EQ(error(binary).code, ErrorCode::bad_input);
}

TEST(PlyReader, AnIndexOutOfRangeNamesElementRowAndPlace) {
    for (const char *bad : {"3 0 1 3\n", "3 0 -1 2\n", "3 0 1 99999999\n"}) {
        const Error e = error(replaced(kTriangle, "3 0 1 2\n", bad));
        EXPECT_EQ(e.code, ErrorCode::bad_input);
        EXPECT_TRUE(has(e.message, "line 13: face 0, vertex_indices: vertex index")) << e.message;
    }
    EXPECT_EQ(error(replaced(kTriangle, "3 0 1 2\n", "3 0 1 3\n")).offset, kTriangle.size() - 2);
    std::string binary = binary_square(false);
    binary[binary.size() - 4] = 4;
    EXPECT_EQ(error(binary).offset, binary.size() - 4);
    EXPECT_TRUE(has(error(binary).message, "face 1, vertex_indices: vertex index 4"));
}

TEST(PlyReader, MessagesAreOneLineWhateverTheNames) {
    const std::string cr =
        replaced(replaced(kTriangle, "property float y", "property float y\nproperty float \nu\x01"), "\n", "\r");
    std::string file = replaced(cr, "\rproperty float \r", "\rproperty float \n");
    EXPECT_FALSE(has(error(file).message, "\n")) << error(file).message;
    EXPECT_TRUE(has(error(replaced(kTriangle, "3 0 1 2\n", "200 0 1 2\n")).message, "a list of 200 entries"));
}

TEST(PlyReader, TheWrongByteOrderIsGuessed) {
    const Error e = error(replaced(binary_square(false), "binary_little_endian", "binary_big_endian"));
    EXPECT_TRUE(has(e.message, "wrong byte order")) << e.message;
}

TEST(PlyReader, WhatIsNoNumberIsRefused) {
    for (const char *bad : {"x", "0,5", "1.2.3", "+-1", "0x10", "--1", "1e", ".", "-", "+", "1e5e5", "\x80\x81"}) {
        const Error e = error(replaced(kTriangle, "1 0 0\n", std::string("1 ") + bad + " 0\n"));
        EXPECT_TRUE(has(e.message, "line 11: vertex 1, y: ")) << bad << ": " << e.message;
    }
    EXPECT_TRUE(has(error(replaced(kTriangle, "1 0 0\n", "1 0,5 0\n")).message, "point"));
    EXPECT_EQ(surface(replaced(kTriangle, "1 0 0\n", "+1 -.5 5.\n")).positions[1], glm::dvec3(1, -0.5, 5));
}

TEST(PlyReader, AValueMustFitItsType) {
    EXPECT_TRUE(has(error(replaced(kTriangle, "3 0 1 2\n", "256 0 1 2\n")).message, "'256' does not fit type uchar"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "3 0 1 2\n", "3 0 1.5 2\n")).message, "'1.5' does not fit type int"));
}

TEST(PlyReader, ARowMustEndWithItsLine) {
    const Error e = error(replaced(kTriangle, "1 0 0\n", "1 0 0 7\n"));
    EXPECT_TRUE(has(e.message, "line 11: vertex 1: more values")) << e.message;
    EXPECT_EQ(surface(replaced(kTriangle, "1 0 0\n", "1 0\n0\n")).positions.size(), 3U);
}

TEST(PlyReader, BadHeadersAreRefused) {
    const std::vector<std::string> bad = {
        "",
        "ply",
        "plyx\n",
        "PLY\n" + kTriangle.substr(4),
        replaced(kTriangle, "end_header\n", ""),
        replaced(kTriangle, "format ascii 1.0\n", ""),
        replaced(kTriangle, "format ascii 1.0\n", "format ascii 1.0\nformat ascii 1.0\n"),
        replaced(kTriangle, "format ascii", "format binary"),
        replaced(kTriangle, "ascii 1.0", "ascii"),
        replaced(kTriangle, "property float z", "property float y"),
        replaced(kTriangle, "property float z", "property floot z"),
        replaced(kTriangle, "property float z", "property float"),
        replaced(kTriangle, "property float z", "property float z z"),
        replaced(kTriangle, "property float z", "property float w"),
        replaced(kTriangle, "property float z", "property list uchar float z"),
        replaced(kTriangle, "list uchar int", "list int"),
        replaced(kTriangle, "element face", "element vertex"),
        replaced(kTriangle, "element vertex", "element point"),
        replaced(kTriangle, "element vertex 3\n", ""),
        replaced(binary_square(false), "property float z", "propertx float z"),
    };
    for (const std::string &file : bad)
        EXPECT_EQ(error(file).code, ErrorCode::bad_input) << file.substr(0, 200);
    EXPECT_EQ(error(replaced(kTriangle, "ascii 1.0", "ascii 2.0")).code, ErrorCode::unsupported_version);
}

TEST(PlyReader, HeaderLimitsHold) {
    std::string elements;
    for (int i = 0; i < 300; ++i)
        elements += "element e" + std::to_string(i) + " 0\n";
    EXPECT_EQ(error(replaced(kTriangle, "end_header", elements + "end_header")).code, ErrorCode::too_large);
    std::string properties;
    for (int i = 0; i < 300; ++i)
        properties += "property int p" + std::to_string(i) + "\n";
    EXPECT_EQ(error(replaced(kTriangle, "end_header", properties + "end_header")).code, ErrorCode::too_large);
    const std::string comment = "comment " + std::string(1 << 20, 'x') + "\n";
    EXPECT_EQ(error(replaced(kTriangle, "end_header", comment + "end_header")).code, ErrorCode::too_large);
}

TEST(PlyReader, UnknownHeaderLinesOfAnAsciiFileAreSkippedAndReported) {
    const Surface s = surface(replaced(kTriangle, "element vertex", "bye\nbye\nelement vertex"));
    EXPECT_EQ(s.triangles.size(), 1U);
    EXPECT_TRUE(has(report(s, "header").note, "2 lines"));
}

TEST(PlyReader, TrailingBytesAreReported) {
    EXPECT_EQ(report(surface(kTriangle + "\n \r\n"), "end of file").note, "");
    EXPECT_TRUE(has(report(surface(kTriangle + "more\n"), "end of file").note, "5 bytes"));
    EXPECT_TRUE(has(report(surface(binary_square(true) + "abc"), "end of file").note, "3 bytes"));
}

TEST(PlyReader, TranslatedLineEndsOfABinaryBodyAreNamed) {
    EXPECT_TRUE(has(error(replaced(binary_square(false), "\n", "\r\n")).message, "binary mode"));
}

TEST(PlyReader, TexturesAndTheirCoordinatesAreReported) {
    const Surface s =
        surface(replaced(kTriangle, "element vertex", "comment TextureFile skin\x01.png\nelement vertex"));
    EXPECT_EQ(report(s, "texture image 'skin?.png'").fate, Fate::dropped);
}

TEST(PlyReader, RangeGridsKeepTheirPoints) {
    const Surface s =
        surface("ply\nformat ascii 1.0\nobj_info num_cols 2\nobj_info num_rows 2\nelement vertex 3\n" + kXyz +
                "element range_grid 4\nproperty list uchar int vertex_indices\nend_header\n"
                "0 0 0\n1 0 0\n0 1 0\n1 0\n1 1\n1 2\n0\n");
    EXPECT_EQ(s.positions.size(), 3U);
    EXPECT_TRUE(has(report(s, "element 'range_grid'").note, "kept as points"));
}

TEST(PlyReader, StrictRefusesWhatWouldBeDropped) {
    const ReadOptions strict{.strict = true, .format = {}, .progress = {}};
    EXPECT_TRUE(read(kTriangle, strict).ok());
    EXPECT_TRUE(has(error(kTriangle + "more\n", strict).message, "--strict: end of file"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "1 0 0\n", "1 nan 0\n"), strict).message, "not finite"));
    EXPECT_TRUE(has(error(replaced(kTriangle, "3 0 1 2\n", "3 0 1 1\n"), strict).message, "degenerate"));
}

TEST(PlyReader, ProgressNeverFallsAndStaysInBounds) {
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

TEST(PlyReader, FlippedBitsNeverGiveAnIndexOutOfRange) {
    std::mt19937 random(1);
    for (const std::string &whole : {kTriangle, binary_square(false), binary_square(true),
                                     kMaterials + "0 0 0 1\n1 1 1 0\n"
                                                  "0 0 0 1 1 1 1 0\n0 0 0 1 1 1 1 0\n"})
        for (int i = 0; i < 4000; ++i) {
            std::string file = whole;
            for (int flips = 0; flips <= i % 3; ++flips)
                file[random() % file.size()] ^= static_cast<char>(1U << (random() % 8));
            const Result<Surface> result = read(file);
            if (!result) {
                EXPECT_FALSE(has(result.error().message, "\n"));
                continue;
            }
            for (const glm::uvec3 &t : result->triangles)
                EXPECT_TRUE(t.x < result->positions.size() && t.y < result->positions.size() &&
                            t.z < result->positions.size());
        }
}

} // namespace
