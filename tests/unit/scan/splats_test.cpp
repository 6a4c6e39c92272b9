// Gaussian splats of every format as discs.
#include "pbm_scan/clouds/gaussian_splats.h"

#include "unit/scan/readings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

void expect_near(const glm::vec3 &a, const glm::vec3 &b) {
    for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(a[axis], b[axis], 2e-3) << axis;
}

TEST(GaussianSplats, ADiscLiesAcrossTheShortestAxis) {
    const glm::quat none(1, 0, 0, 0), quarter_about_x(std::sqrt(0.5F), std::sqrt(0.5F), 0, 0);
    const SplatDisc disc = disc_of({0.3F, 0.01F, 1.2F}, none);
    expect_near(disc.normal, {0, 1, 0});
    EXPECT_FLOAT_EQ(disc.radius, 0.6F); // sqrt(0.3 * 1.2)
    expect_near(disc_of({0.3F, 0.01F, 1.2F}, quarter_about_x).normal, {0, 0, 1});
    expect_near(disc_of({0.3F, 0.01F, 1.2F}, quarter_about_x * 7.0F).normal, {0, 0, 1}); // of any length
}

TEST(GaussianSplats, WithoutAShapeThereIsNoDisc) {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
    const glm::quat none(1, 0, 0, 0);
    for (const SplatDisc &disc :
         {disc_of({1, kNan, 1}, none), disc_of({1, 1, kInfinity}, none), disc_of({1, 0, 0}, none),
          disc_of({1, 1, 1}, glm::quat(0, 0, 0, 0)), disc_of({1, 1, 1}, glm::quat(kNan, 0, 0, 0))}) {
        EXPECT_EQ(disc.normal, glm::vec3(0));
        EXPECT_EQ(disc.radius, 0);
    }
}

// Three splats; the last one has an opacity of 1 / (1 + e) = 0.27.
std::string ply_of(const std::string &properties, const std::vector<std::string> &rows) {
    std::string file = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(rows.size()) + "\n";
    std::string name;
    for (const char letter : properties + " ")
        if (letter == ' ')
            file += "property float " + std::exchange(name, "") + "\n";
        else
            name += letter;
    file += "end_header\n";
    for (const std::string &row : rows)
        file += row + "\n";
    return file;
}
constexpr const char *kProperties =
    "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 f_rest_0 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
const std::vector<std::string> kRows{"0 0 0 0 0 0 0 0 0 9 4 -1 -1 -5 1 0 0 0", "1 0 0 0 0 0 0 0 0 9 4 -5 -1 -3 2 0 0 0",
                                     "2 0 0 0 0 0 0 0 0 9 -1 -1 -1 -5 1 0 0 0"};

TEST(GaussianSplats, PlyHasLogarithmsAndLogits) {
    const Surface s = surface(ply_of(kProperties, kRows), "scan.ply");
    ASSERT_EQ(s.positions.size(), 3U);
    expect_near(s.normals[0], {0, 0, -1}); // turned upright, as all places
    expect_near(s.normals[1], {1, 0, 0});
    EXPECT_TRUE(reports(s, "axes", Fate::converted));
    EXPECT_NEAR(s.radii[0], std::exp(-1.0), 1e-6);
    EXPECT_NEAR(s.radii[1], std::exp(-2.0), 1e-6); // of -1 and -3
    EXPECT_EQ(s.two_sided, (std::vector<std::uint8_t>{1, 1, 1}));
    EXPECT_TRUE(has(note_of(s, "opacity"), "0 of 3 splats"));
    EXPECT_TRUE(reports(s, "scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3", Fate::converted));
    EXPECT_TRUE(reports(s, "f_rest_0", Fate::dropped));
}

TEST(GaussianSplats, FaintOnesAreLeftOutAndCounted) {
    const Surface s = surface(ply_of(kProperties, kRows), "scan.ply", {.min_opacity = 0.3});
    ASSERT_EQ(s.positions.size(), 2U);
    EXPECT_EQ(s.radii.size(), 2U);
    EXPECT_TRUE(has(note_of(s, "opacity"), "1 of 3 splats are fainter than 0.3"));
    const Result<Surface> none = read(ply_of(kProperties, kRows), "scan.ply", {.min_opacity = 0.99});
    ASSERT_FALSE(none.ok());
    EXPECT_TRUE(has(none.error().message, "all splats are fainter than 0.99"));
}

TEST(GaussianSplats, AFieldMayBeAShapeToo) {
    const Surface s = surface(ply_of(kProperties, kRows), "scan.ply", {.fields = {"opacity", "scale_1"}});
    EXPECT_EQ(s.field_values[0][2].number, -1);
    EXPECT_EQ(s.field_values[1][1].number, -1);
    EXPECT_NEAR(s.radii[1], std::exp(-2.0), 1e-6);
    EXPECT_TRUE(has(note_of(s, "opacity"), "0 of 3 splats"));
}

TEST(GaussianSplats, FlatOnesHaveTwoScales) {
    const Surface s = surface(ply_of("x y z f_dc_0 f_dc_1 f_dc_2 scale_0 scale_1 rot_0 rot_1 rot_2 rot_3",
                                     {"0 0 0 0 0 0 -1 -3 1 0 0 0", "1 1 1 0 0 0 -1 -3 1 0 0 0"}),
                              "scan.ply");
    expect_near(s.normals[0], {0, 0, -1});
    EXPECT_NEAR(s.radii[0], std::exp(-2.0), 1e-6);
    EXPECT_EQ(note_of(s, "opacity"), "no such line");
}

TEST(GaussianSplats, AnIncompleteShapeIsNamed) {
    const Surface s = surface(
        ply_of("x y z f_dc_0 f_dc_1 f_dc_2 scale_0 scale_1", {"0 0 0 0 0 0 -1 -3", "1 1 1 0 0 0 -1 -3"}), "scan.ply");
    EXPECT_TRUE(s.radii.empty());
    EXPECT_TRUE(has(report_of(s, "scale_1").note, "needs scale_0 scale_1 rot_0"));
}

// Packed integers of a .compressed.ply: one chunk.
struct PackedPly {
    int chunks = 1, vertices = 2;
    std::string format = "binary_little_endian", colours = "min_r min_g min_b max_r max_g max_b";
    std::vector<float> bounds{0, 0, 0, 2, 2, 2, -4, -4, -4, 0, 0, 0, 0, 0, 0, 1, 0.5F, 1};
    // Places 0 0 0 and 2 2 2; both with the scales of -4, -4 and 0; the second turned by a quarter about x.
    std::vector<std::uint32_t> words{0,     0x20080200, 0x7FF, 0xFF8000FF, 0xFFFFFFFF, 0x20080200 | 1023u << 20,
                                     0x7FF, 0x000000FF};

    std::string file() const {
        std::string text = "ply\nformat " + format + " 1.0\nelement chunk " + std::to_string(chunks) + "\n", name;
        for (const char letter : "min_x min_y min_z max_x max_y max_z min_scale_x min_scale_y min_scale_z max_scale_x "
                                 "max_scale_y max_scale_z " +
                                     colours + " ")
            if (letter != ' ')
                name += letter;
            else if (!name.empty())
                text += "property float " + std::exchange(name, "") + "\n";
        text += "element vertex " + std::to_string(vertices) + "\n";
        for (const char *each : {"packed_position", "packed_rotation", "packed_scale", "packed_color"})
            text += std::string("property uint ") + each + "\n";
        text += "end_header\n";
        for (const float bound : bounds)
            text += raw(bound);
        for (const std::uint32_t word : words)
            text += raw(word);
        return text;
    }
};

TEST(GaussianSplats, PackedPlyIsRead) {
    const Surface s = surface(PackedPly().file(), "scan.ply");
    ASSERT_EQ(s.positions.size(), 2U);
    EXPECT_EQ(s.positions[0], glm::dvec3(0));
    EXPECT_EQ(s.positions[1], glm::dvec3(2, -2, -2)); // y points upwards
    EXPECT_EQ(s.colours[0], (Rgb8{255, 64, 0}));
    EXPECT_EQ(s.colours[1], (Rgb8{0, 0, 0}));
    // Of -4, -4 and 0 the first one is the shortest axis.
    expect_near(s.normals[0], {1, 0, 0});
    EXPECT_NEAR(s.radii[0], std::exp(-2.0), 1e-5);
    PackedPly old;
    old.colours.clear();
    old.bounds.resize(12);
    EXPECT_EQ(surface(old.file(), "scan.ply").colours[0], (Rgb8{255, 128, 0}));
}

TEST(GaussianSplats, DamagedPackedPlyIsRefused) {
    const std::string file = PackedPly().file();
    const std::size_t body = file.find("end_header");
    for (std::size_t size = body; size < file.size(); ++size)
        EXPECT_FALSE(read(file.substr(0, size), "scan.ply").ok()) << size;
    EXPECT_TRUE(has(note_of(surface(file + "more", "scan.ply"), "end of file"), "4 bytes"));
    PackedPly few;
    few.vertices = 300;
    few.words.resize(4 * 300);
    EXPECT_TRUE(has(error(few.file(), "scan.ply").message, "fewer chunks than 300 splats need"));
    PackedPly big;
    big.format = "binary_big_endian";
    EXPECT_EQ(error(big.file(), "scan.ply").code, ErrorCode::unsupported_feature);
    PackedPly faint;
    faint.words[3] = faint.words[7] = 0;
    EXPECT_TRUE(has(error(faint.file(), "scan.ply").message, "all splats are fainter"));
    PackedPly wrong;
    wrong.colours = "min_r";
    wrong.bounds.resize(13);
    EXPECT_TRUE(has(error(wrong.file(), "scan.ply").message, "has not the properties of packed Gaussian splats"));
}

} // namespace
