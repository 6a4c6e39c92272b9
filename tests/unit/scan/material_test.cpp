// Materials of OBJ files: what their material files say, and which points have them.
#include "pbm_scan/conventions/reflectance.h"
#include "pbm_scan/mesh/material_text.h"
#include "pbm_scan/surface_reader.h"
#include "unit/support/image_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;

std::vector<NamedMaterial> materials_of(std::string_view text, std::vector<AttributeReport> *said = nullptr) {
    std::vector<NamedMaterial> materials;
    std::vector<AttributeReport> report;
    read_materials(text, Material{}, materials, said != nullptr ? *said : report);
    finish_colours(materials, said != nullptr ? *said : report);
    return materials;
}

// An OBJ beside a file of these materials.
Surface obj_with(const std::string &text, const std::string &materials,
                 const std::vector<std::pair<std::string, Bytes>> &images = {}) {
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "pbm_materials";
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "scan.mtl") << materials;
    for (const auto &[name, bytes] : images)
        std::ofstream(folder / name, std::ios::binary)
            .write(reinterpret_cast<const char *>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    std::ofstream(folder / "scan.obj") << "mtllib scan.mtl\n" << text;
    Result<Surface> result = read_surface((folder / "scan.obj").string(), {});
    std::filesystem::remove_all(folder);
    EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
    return result.ok() ? std::move(*result) : Surface{};
}

TEST(Materials, ColoursOfBytesAreScaledForAllMaterials) {
    std::vector<AttributeReport> said;
    const auto bytes = materials_of("newmtl a\nKd 200 100 30\nnewmtl black\nKd 1 0 0\n", &said);
    EXPECT_EQ(bytes[0].material.colour, (Rgb8{200, 100, 30}));
    EXPECT_EQ(bytes[1].material.colour, (Rgb8{1, 0, 0}));
    ASSERT_EQ(said.size(), 1U);
    EXPECT_EQ(said[0].fate, Fate::converted);
    EXPECT_EQ(said[0].note, "their colours, in 0..255, to sRGB of 8 bits");
    // One bright material among others is none of bytes.
    const auto bright = materials_of("newmtl a\nKd 0.8 0.4 0.1\nnewmtl lamp\nKd 12 12 12\n");
    EXPECT_EQ(bright[0].material.colour, (Rgb8{204, 102, 26}));
    EXPECT_EQ(bright[1].material.colour, (Rgb8{255, 255, 255}));
}

TEST(Materials, StatementsBecomeAMaterialOrALine) {
    std::vector<AttributeReport> said;
    const auto materials =
        materials_of("# Blender\r\nKd 1 1 1\nnewmtl dark red #1\r\n\tKd 0.502 0 2\r\nKs 0.3 0.6 0.9\n"
                     "Ns 5000\nd 0.5\nillum 2\nmap_Kd a.png\nKa 1 1 1\nnewmtl other\nKd spectral x.rfl\n",
                     &said);
    ASSERT_EQ(materials.size(), 2U);
    EXPECT_EQ(materials[0].name, "dark red #1");
    EXPECT_EQ(materials[0].material.colour, (Rgb8{128, 0, 255}));
    EXPECT_NEAR(materials[0].material.ks, 0.6, 1e-6);
    EXPECT_EQ(materials[0].material.power, 1024);
    EXPECT_EQ(materials[0].material.kd, Material{}.kd);
    EXPECT_EQ(materials[1].material, Material{});
    const auto fate_of = [&](std::string_view name) {
        const auto line = std::find_if(said.begin(), said.end(), [&](const auto &l) { return l.name == name; });
        return line == said.end() ? std::optional<Fate>() : line->fate;
    };
    EXPECT_EQ(fate_of("Kd of materials"), Fate::kept);
    EXPECT_EQ(fate_of("Ks of materials"), Fate::converted);
    EXPECT_EQ(fate_of("Ns of materials"), Fate::kept);
    EXPECT_EQ(fate_of("opacity of materials"), Fate::dropped);
    EXPECT_EQ(fate_of("illum of materials"), Fate::dropped);
    EXPECT_EQ(fate_of("Ka of materials"), Fate::dropped);
    EXPECT_EQ(fate_of("Kd of materials without numbers"), Fate::dropped);
    EXPECT_EQ(said.size(), 7U);
}

const std::string kStrip = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 2 0\nv 1 2 0\n";

TEST(Materials, RoughnessAndMetalReplaceTheOlderCoefficients) {
    std::vector<AttributeReport> said;
    auto materials = materials_of("newmtl a\nKs 1 1 1\nNs 5\nPr 0.5\nPm 1\nnewmtl b\nPm 0.5\nNs 30\nnewmtl c\nNs 30\n"
                                  "Ke 0 0 0\nnewmtl lamp\nKs 0.02 0.02 0.02\nNs 30\nKe 1 0.5 0\nPs 1\n",
                                  &said);
    for (NamedMaterial &named : materials)
        finish_reflectance(named);
    Material of_a;
    set_reflectance({0.5, 1}, of_a);
    EXPECT_EQ(materials[0].material.ks, of_a.ks);
    EXPECT_EQ(materials[0].material.power, of_a.power);
    EXPECT_EQ(materials[0].material.environment, of_a.environment);
    ASSERT_TRUE(materials[1].reflectance);
    EXPECT_NEAR(materials[1].reflectance->roughness, 0.5, 1e-9); // the power of Ns
    EXPECT_NEAR(materials[1].material.power, 30, 1e-3);
    EXPECT_FALSE(materials[2].reflectance); // its coefficients stay
    ASSERT_TRUE(materials[3].reflectance);
    EXPECT_EQ(materials[3].emission, (Rgb8{255, 128, 0}));
    EXPECT_NEAR(materials[3].reflectance->specular, 0.4, 1e-6); // ks = 0.1 specular (1 - roughness)
    EXPECT_FLOAT_EQ(materials[3].material.ks, 0.02F);
    const auto is_said = [&](const char *name, Fate fate) {
        return std::any_of(said.begin(), said.end(), [&](const auto &l) { return l.name == name && l.fate == fate; });
    };
    EXPECT_TRUE(is_said("Pr of materials", Fate::converted) && is_said("Ke of materials", Fate::converted));
    EXPECT_TRUE(is_said("Ps of materials", Fate::dropped));
}

TEST(Materials, ImagesOfRoughnessMetalAndLightAreLayers) {
    const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nusemtl a\nf 1/1 2/2 3/3\n";
    const Bytes grey{51, 51, 51}, red{255, 0, 0};
    const std::vector<std::pair<std::string, Bytes>> images{
        {"rough.png", test::png_of(1, 1, PNG_FORMAT_RGB, grey.data())},
        {"light.png", test::png_of(1, 1, PNG_FORMAT_RGB, red.data())}};
    const Surface both =
        obj_with(square, "newmtl a\nPr 0.9\nPm 0.5\nmap_Pr -s 2 1 rough.png\nmap_Ke light.png\nKe 0 0 0\n", images);
    ASSERT_EQ(both.layer(Layer::reflectance).ids.size(), 1U);
    // Roughness 0.2 of the image, metal 0.5 of the material.
    EXPECT_EQ(both.textures[both.layer(Layer::reflectance).ids[0]].texels[0],
              (std::array<std::uint8_t, 4>{51, 102, 204, 255}));
    EXPECT_EQ(both.layer(Layer::reflectance).corners[0], (TextureCorners{{{0, 1}, {2, 1}, {2, 0}}}));
    ASSERT_EQ(both.layer(Layer::emission).ids.size(), 1U);
    EXPECT_EQ(both.textures[both.layer(Layer::emission).ids[0]].texels[0],
              (std::array<std::uint8_t, 4>{255, 0, 0, 255}));
    ASSERT_EQ(both.reflectances.size(), 1U);
    EXPECT_EQ(both.reflectances[0], (Reflectance{0.9, 0.5}));
    // Light of the material alone lies on all faces, with or without texture coordinates.
    const Surface lamp = obj_with(square + "f 1 2 3\n", "newmtl a\nKe 1 1 1\nmap_Pm rough.png\n", images);
    EXPECT_EQ(lamp.layer(Layer::emission).ids.size(), 2U);
    ASSERT_EQ(lamp.layer(Layer::reflectance).ids.size(), 2U);
    EXPECT_NE(lamp.layer(Layer::reflectance).ids[1], Surface::kNoTexture); // the factors
    EXPECT_NE(lamp.layer(Layer::reflectance).ids[0], lamp.layer(Layer::reflectance).ids[1]);
    // One image for both, but not as it lies.
    const Surface apart = obj_with(square, "newmtl a\nmap_Pr rough.png\nmap_Pm -o 0.5 0 rough.png\n", images);
    const auto is_metal = [](const AttributeReport &line) { return line.name == "map_Pm of materials"; };
    EXPECT_TRUE(std::any_of(apart.report.begin(), apart.report.end(), is_metal));
    // None is there: the numbers count.
    const Surface missing = obj_with(square, "newmtl a\nPr 0.25\nmap_Pr none.png\nmap_Ke none.png\n");
    EXPECT_TRUE(missing.textures.empty());
    EXPECT_EQ(missing.reflectances[0], (Reflectance{0.25, 0}));
    // An image that is none: so does the light of the material.
    const Surface broken = obj_with(square, "newmtl a\nmap_Ke bad.png\nKe 0 0.5 0\n", {{"bad.png", Bytes{1, 2, 3}}});
    EXPECT_EQ(broken.layer(Layer::emission).ids.size(), 1U);
}

// A material beside one that differs in its light alone keeps its own reflection.
TEST(Materials, OfOneColourWithAndWithoutLightAreTwo) {
    const std::string faces = "usemtl lamp\nf 1 2 3\nusemtl plain\nf 2 4 3\n";
    const Surface s = obj_with(kStrip + faces, "newmtl lamp\nKd 1 0 0\nKs 0.5 0.5 0.5\nNs 50\nKe 0.2 0.2 0.2\n"
                                               "newmtl plain\nKd 1 0 0\nKs 0.5 0.5 0.5\nNs 50\n");
    ASSERT_EQ(s.reflectances.size(), s.materials.size());
    std::size_t without = 0;
    for (std::size_t i = 0; i < s.materials.size(); ++i)
        if (s.materials[i].colour == Rgb8{255, 0, 0}) {
            EXPECT_FLOAT_EQ(s.materials[i].ks, 0.5F);
            without += s.reflectances[i] ? 0 : 1;
        }
    EXPECT_EQ(without, 1U);
}

TEST(Materials, FacesHaveThoseThatTheyName) {
    const std::string materials = "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\nnewmtl again\nKd 1 0 0\n";
    const Surface s =
        obj_with(kStrip + "f 1 2 3\nusemtl red\nf 2 4 3\nusemtl blue\nf 3 4 5\nusemtl again\nf 4 6 5\n", materials);
    ASSERT_EQ(s.materials.size(), 3U) << "the default one, red, blue";
    ASSERT_EQ(s.material_ids.size(), s.positions.size());
    const auto colour = [&](std::size_t face) {
        const glm::uvec3 &t = s.triangles[face];
        EXPECT_EQ(s.material_ids[t.x], s.material_ids[t.y]);
        EXPECT_EQ(s.material_ids[t.x], s.material_ids[t.z]);
        return s.materials[s.material_ids[t.x]].colour;
    };
    EXPECT_EQ(colour(0), Material{}.colour);
    EXPECT_EQ(colour(1), (Rgb8{255, 0, 0}));
    EXPECT_EQ(colour(2), (Rgb8{0, 0, 255}));
    EXPECT_EQ(colour(3), (Rgb8{255, 0, 0}));
    for (std::size_t face = 0; face < 4; ++face) {
        const Surface plain = obj_with(kStrip + "f 1 2 3\nf 2 4 3\nf 3 4 5\nf 4 6 5\n", "");
        for (int corner = 0; corner < 3; ++corner)
            EXPECT_EQ(s.positions[s.triangles[face][corner]], plain.positions[plain.triangles[face][corner]]);
    }
}

TEST(Materials, MoreThanAModelHoldsBecomeColours) {
    std::string text, faces = kStrip;
    for (int i = 0; i < 12; ++i) {
        text += "newmtl m" + std::to_string(i) + "\nKd 0 0 " + std::to_string(i / 20.0) + "\n";
        faces += "usemtl m" + std::to_string(i) + "\nf 1 2 3\n";
    }
    const Surface s = obj_with(faces, text);
    EXPECT_TRUE(s.materials.empty());
    ASSERT_EQ(s.colours.size(), s.positions.size());
    EXPECT_EQ(s.colours[s.triangles[11].x], (Rgb8{0, 0, 140}));
    EXPECT_TRUE(std::any_of(s.report.begin(), s.report.end(),
                            [](const auto &line) { return line.name == "materials" && line.fate == Fate::converted; }));
}

TEST(Materials, UnknownNamesHaveTheDefaultOne) {
    const Surface s = obj_with(kStrip + "usemtl none\nf 1 2 3\n", "newmtl red\nKd 1 0 0\n");
    EXPECT_TRUE(s.materials.empty());
    EXPECT_TRUE(s.material_ids.empty());
    EXPECT_EQ(s.positions.size(), 6U);
}

} // namespace
