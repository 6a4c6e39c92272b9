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

TEST(PlyAttributes, ColoursComeInEverySpellingAndRange) {
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

TEST(PlyAttributes, ColoursOfFacesAreTheirOwn) {
    const std::string head = "ply\nformat ascii 1.0\nelement vertex 4\n" + kXyz;
    const std::string face =
        "element face 2\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty uchar "
        "green\nproperty uchar blue\nproperty uchar alpha\nend_header\n";
    const Surface s = surface(head + face + "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 100 0 0 255\n3 0 2 3 200 10 0 255\n");
    EXPECT_TRUE(s.colours.empty());
    EXPECT_EQ(s.face_colours, (std::vector<pbm::build::FaceColour>{{{100, 0, 0}, true}, {{200, 10, 0}, true}}));
    EXPECT_EQ(s.positions.size(), 4U) << "no vertex is split";
    EXPECT_EQ(report(s, "face.red green blue").fate, Fate::kept);
    EXPECT_EQ(report(s, "face.alpha").fate, Fate::dropped);

    const std::string own = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    const Surface kept = surface(head + own + face +
                                 "0 0 0 1 2 3\n1 0 0 1 2 3\n1 1 0 1 2 3\n0 1 0 1 2 3\n"
                                 "3 0 1 2 100 0 0 255\n3 0 2 3 200 10 0 255\n");
    EXPECT_EQ(kept.colours[0], (Colour{1, 2, 3}));
    EXPECT_EQ(report(kept, "face.red green blue").fate, Fate::dropped);
}

TEST(PlyAttributes, ColoursOfFacesFollowTheirTriangles) {
    const std::string xyz = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n", vertices = "element vertex 4\n" + kXyz;
    const std::string faces = "3 0 1 1 9 9 9\n4 0 1 2 3 0.2 0.4 0.6\n3 0 1 2 1 0 0.5\n";
    const std::string element = "element face 3\nproperty list uchar int vertex_indices\nproperty float red\n"
                                "property float green\nproperty float blue\n";
    const std::string strips = "element tristrips 1\nproperty list int int vertex_indices\n";
    const std::string head = "ply\nformat ascii 1.0\n";
    const std::vector<pbm::build::FaceColour> expected{
        {{51, 102, 153}, true}, {{51, 102, 153}, true}, {{255, 0, 128}, true}};
    std::vector<pbm::build::FaceColour> behind = expected, before{{}};
    behind.emplace_back();
    before.insert(before.end(), expected.begin(), expected.end());
    EXPECT_EQ(surface(head + vertices + element + "end_header\n" + xyz + faces).face_colours, expected);
    EXPECT_EQ(surface(head + element + vertices + "end_header\n" + faces + xyz).face_colours, expected);
    EXPECT_EQ(surface(head + vertices + element + strips + "end_header\n" + xyz + faces + "3 0 1 3\n").face_colours,
              behind);
    EXPECT_EQ(surface(head + vertices + strips + element + "end_header\n" + xyz + "3 0 1 3\n" + faces).face_colours,
              before);
    EXPECT_EQ(surface(head + strips + element + vertices + "end_header\n" + "3 0 1 3\n" + faces + xyz).face_colours,
              before);
}

TEST(PlyAttributes, MaterialsOfTheDissertationAreRead) {
    const Surface s = surface(kMaterials + "0 0 0 1\n1 1 1 0\n0.1 0.5 0.4 20 255 128 0 0.25\n0.2 0.8 0 1 10 20 30 0\n");
    ASSERT_EQ(s.materials.size(), 2U);
    EXPECT_FLOAT_EQ(s.materials[0].kd, 0.5F);
    EXPECT_FLOAT_EQ(s.materials[0].power, 20.0F);
    EXPECT_FLOAT_EQ(s.materials[0].environment, 0.25F);
    EXPECT_EQ(s.materials[0].colour, (Colour{255, 128, 0}));
    EXPECT_EQ(s.material_ids, (std::vector<std::uint8_t>{1, 0}));
    const Surface unit = surface(kMaterials + "0 0 0 1\n1 1 1 0\n0 0 0 1 1 0.5 0 0\n0 0 0 1 0 0 1 0\n");
    EXPECT_EQ(unit.materials[0].colour, (Colour{255, 128, 0}));
    const std::string shapes = replaced(kMaterials, "envmapfactor\n", "envmapfactor\nproperty uchar shape\n");
    const Surface round = surface(shapes + "0 0 0 1\n1 1 1 0\n0 0 0 1 1 1 0 0 1\n0 0 0 1 0 0 1 0 2\n");
    EXPECT_EQ(round.materials[0].shape, PointShape::round);
    EXPECT_EQ(round.materials[1].shape, PointShape::disc); // a shape of later versions
    const std::string tints = replaced(kMaterials, "envmapfactor\n", "envmapfactor\nproperty uchar tint\n");
    EXPECT_EQ(surface(tints + "0 0 0 1\n1 1 1 0\n0 0 0 1 1 1 0 0 1\n0 0 0 1 0 0 1 0 255\n").materials[1].tint, 255);
}

TEST(PlyAttributes, ImpossibleMaterialsAreRefused) {
    EXPECT_TRUE(has(error(kMaterials + "0 0 0 2\n1 1 1 0\n0 0 0 1 1 1 1 0\n0 0 0 1 1 1 1 0\n").message, "material 2"));
    EXPECT_TRUE(
        has(error(kMaterials + "0 0 0 0\n1 1 1 0\n0 0 0 1 1 1 1 0\n0 0 0 1 1 1 1 7\n").message, "envmapfactor"));
    EXPECT_TRUE(has(error(kMaterials + "0 0 0 0\n1 1 1 0\n-1 0 0 1 1 1 1 0\n0 0 0 1 1 1 1 0\n").message, "ka"));
    std::string nine = replaced(kMaterials, "element material 2", "element material 9") + "0 0 0 1\n1 1 1 0\n";
    for (int i = 0; i < 9; ++i)
        nine += "0.1 0.5 0.4 20 255 128 0 0\n";
    EXPECT_EQ(error(nine).code, ErrorCode::too_large);
}

TEST(PlyAttributes, AMaterialIndexWithoutMaterialsIsDropped) {
    const Surface s = surface("ply\nformat ascii 1.0\nelement vertex 1\n" + kXyz +
                              "property int material_index\nend_header\n1 2 3 4\n");
    EXPECT_TRUE(s.material_ids.empty());
    EXPECT_EQ(report(s, "vertex.material_index").fate, Fate::dropped);
}

TEST(PlyAttributes, RadiiMustBePositive) {
    const std::string head = "ply\nformat ascii 1.0\nelement vertex 2\n" + kXyz + "property float radius\nend_header\n";
    EXPECT_EQ(surface(head + "0 0 0 0.5\n1 1 1 2\n").radii, (std::vector<float>{0.5F, 2.0F}));
    const Surface s = surface(head + "0 0 0 0.5\n1 1 1 0\n");
    EXPECT_TRUE(s.radii.empty());
    EXPECT_EQ(report(s, "vertex.radius").fate, Fate::dropped);
}

TEST(PlyAttributes, NormalsThatAreNotFiniteHaveNoLength) {
    const std::string head = "ply\nformat ascii 1.0\nelement vertex 2\n" + kXyz +
                             "property float normal_x\nproperty float normal_y\nproperty float normal_z\nend_header\n";
    const Surface s = surface(head + "0 0 0 0 0 2\n1 1 1 nan 0 1\n");
    EXPECT_EQ(s.normals[0], glm::vec3(0, 0, 2));
    EXPECT_EQ(s.normals[1], glm::vec3(0));
    EXPECT_TRUE(surface(head + "0 0 0 0 0 0\n1 1 1 0 0 0\n").normals.empty());
}

TEST(PlyAttributes, NumbersTellTheRangeOfFloatColours) {
    const auto first = [](const std::string &values) {
        return surface("ply\nformat ascii 1.0\nelement vertex 2\n" + kXyz +
                       "property float red\nproperty float green\nproperty float blue\nend_header\n0 0 0 " + values +
                       "\n1 1 1 0 0 0\n")
            .colours[0];
    };
    EXPECT_EQ(first("1 0.5 0"), (Colour{255, 128, 0}));
    EXPECT_EQ(first("1.01 0.5 -0.01"), (Colour{255, 128, 0})); // values a filter has pushed beyond 0..1
    EXPECT_EQ(first("200 100 50"), (Colour{200, 100, 50}));
    EXPECT_EQ(first("65535 32896 0"), (Colour{255, 128, 0}));
}

TEST(PlyAttributes, AGaussianSplatsMeanColourIsConverted) {
    const std::string file =
        "ply\nformat ascii 1.0\nelement vertex 3\n" + kXyz +
        "property float nx\nproperty float ny\nproperty float nz\nproperty float f_dc_0\nproperty float f_dc_1\n"
        "property float f_dc_2\nproperty float f_rest_0\nproperty float opacity\nproperty float scale_0\n"
        "property float rot_0\nend_header\n"
        "0 0 0 0 0 0 0 1.7724539 -1.7724539 9 1 1 1\n0 0 1 0 0 0 0.5 3 -3 9 1 1 1\n0 1 1 0 0 0 nan 0 0 9 1 1 1\n";
    const Surface s = surface(file);
    ASSERT_EQ(s.colours.size(), 3U);
    EXPECT_EQ(s.colours[0], (Colour{128, 255, 0}));
    EXPECT_EQ(s.colours[1], (Colour{163, 255, 0})); // 0.5 + 0.5 * 0.28209 = 0.641
    EXPECT_EQ(s.colours[2], (Colour{0, 128, 128}));
    EXPECT_TRUE(s.normals.empty());
    EXPECT_EQ(report(s, "vertex.f_dc_0 f_dc_1 f_dc_2").fate, Fate::converted);
    EXPECT_TRUE(has(report(s, "vertex.f_rest_0").note, "direction"));
    EXPECT_TRUE(has(report(s, "vertex.opacity").note, "opaque"));
    // Ordinary colours take precedence.
    const Surface own =
        surface(replaced(replaced(replaced(file, "f_rest_0", "red"), "scale_0", "green"), "rot_0", "blue"));
    EXPECT_EQ(own.colours[0], (Colour{9, 1, 1}));
    EXPECT_EQ(report(own, "vertex.f_dc_0 f_dc_1 f_dc_2").fate, Fate::dropped);
}

TEST(PlyAttributes, DroppedPropertiesAreNamedWithTheReason) {
    std::string file = "ply\nformat ascii 1.0\nelement camera 1\nproperty float view_px\nelement vertex 1\n" + kXyz;
    for (const char *name :
         {"s", "t", "u", "v", "quality", "confidence", "intensity", "scalar_Distance", "alpha", "flags"})
        file += std::string("property float ") + name + "\n";
    file += "property list uchar float weights\nelement edge 1\nproperty int vertex1\nelement empty 0\nproperty int a\n"
            "end_header\n7\n1 2 3 0 0 0 0 0 0 0 0 0 0 1 0.5\n0\n";
    const Surface s = surface(file);
    EXPECT_TRUE(has(report(s, "vertex.s t u v").note, "texture"));
    EXPECT_TRUE(has(report(s, "vertex.quality confidence intensity scalar_Distance").note, "measurement"));
    EXPECT_TRUE(has(report(s, "vertex.alpha").note, "opaque"));
    EXPECT_EQ(report(s, "vertex.flags").fate, Fate::dropped);
    EXPECT_TRUE(has(report(s, "vertex.weights").note, "list"));
    EXPECT_TRUE(has(report(s, "element 'camera'").note, "cameras"));
    EXPECT_TRUE(has(report(s, "element 'edge'").note, "lines"));
    EXPECT_EQ(report(s, "element 'empty'").name, "");
}

} // namespace
