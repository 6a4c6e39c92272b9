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

TEST(PlyHeader, LineEndsMayBeCrLfOrCr) {
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

TEST(PlyHeader, ABinaryBodyMayBeginWithALineEnd) {
    for (const char first : {'\n', '\r'}) {
        std::string file = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar "
                           "y\nproperty uchar z\nend_header\n";
        file += {first, 5, 6};
        EXPECT_EQ(surface(file).positions[0], glm::dvec3(first, 5, 6));
    }
}

TEST(PlyHeader, AHeaderWithOnlyCrKeepsALfThatBelongsToTheBody) {
    std::string file = "ply\rformat binary_little_endian 1.0\relement vertex 1\rproperty uchar x\rproperty uchar "
                       "y\rproperty uchar z\rend_header\r";
    file += {'\n', 5, 6};
    EXPECT_EQ(surface(file).positions[0], glm::dvec3(10, 5, 6));
}

TEST(PlyHeader, CommentsStandAnywhereAlsoAsTheLastHeaderLine) {
    std::string file = replaced(kTriangle, "element", "comment element vertex 9\nobj_info num_cols 512\nelement");
    file = replaced(file, "end_header", "comment\nobj_info last\ncomment end_header\nend_header");
    file = replaced(file, "ply\n", "ply\ncomment before the format\n");
    EXPECT_EQ(surface(file).triangles.size(), 1U);
}

TEST(PlyHeader, WhiteSpaceIsFree) {
    std::string file = replaced(kTriangle, "element vertex 3", "  element \t vertex   3  ");
    file = replaced(file, "1 0 0\n", "\n  1\t0   0  \n\n");
    EXPECT_EQ(surface(file).positions[1], glm::dvec3(1, 0, 0));
}

TEST(PlyHeader, BadHeadersAreRefused) {
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

TEST(PlyHeader, HeaderLimitsHold) {
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

TEST(PlyHeader, UnknownHeaderLinesOfAnAsciiFileAreSkippedAndReported) {
    const Surface s = surface(replaced(kTriangle, "element vertex", "bye\nbye\nelement vertex"));
    EXPECT_EQ(s.triangles.size(), 1U);
    EXPECT_TRUE(has(report(s, "header").note, "2 lines"));
}

TEST(PlyHeader, TexturesAndTheirCoordinatesAreReported) {
    const Surface s =
        surface(replaced(kTriangle, "element vertex", "comment TextureFile skin\x01.png\nelement vertex"));
    EXPECT_EQ(report(s, "texture image 'skin?.png'").fate, Fate::dropped);
}

TEST(PlyHeader, OfManyTexturesTheFirstAreNamedAndTheOthersCounted) {
    std::string comments;
    for (int i = 0; i < 1000; ++i)
        comments += "comment TextureFile skin" + std::to_string(i) + ".png\n";
    const Surface s = surface(replaced(kTriangle, "element vertex", comments + "element vertex"));
    EXPECT_EQ(report(s, "texture image 'skin15.png'").fate, Fate::dropped);
    EXPECT_EQ(report(s, "984 further texture images").fate, Fate::dropped);
    EXPECT_LT(s.report.size(), 24U);
}

TEST(PlyHeader, AMissingEndIsSaidWithTheFirstLineThatIsNoHeader) {
    const Error e = error(replaced(kTriangle, "end_header\n", ""));
    EXPECT_TRUE(has(e.message, "no end_header")) << e.message;
    EXPECT_TRUE(has(e.message, "line 9 begins with '0'")) << e.message;
}

} // namespace
