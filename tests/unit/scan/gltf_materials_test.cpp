// Materials of glTF: how they reflect, what they emit, and what is dropped.
#include "unit/scan/gltf_files.h"
#include "unit/support/image_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

// A square whose material is `material`; its images 0 and 1 are one texel, {0, 51, 102, 204}, and no image.
Surface with_reflectance(const json &material) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2});
    const auto places = glb.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 2);
    const Bytes pixels{0, 51, 102, 204};
    glb.doc["images"] = {{{"bufferView", glb.view(png_of(1, 1, PNG_FORMAT_RGBA, pixels.data()))}},
                         {{"bufferView", glb.view(Bytes{1, 2, 3})}}};
    glb.doc["textures"] = {{{"source", 0}}, {{"source", 1}}};
    glb.doc["materials"] = {material};
    glb.show(
        {{{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", places}}}, {"indices", indices}, {"material", 0}}});
    return surface(glb);
}

TEST(Gltf, RoughnessAndMetalOfImagesAreKept) {
    const Surface s = with_reflectance(
        {{"pbrMetallicRoughness",
          {{"metallicRoughnessTexture", {{"index", 0}}}, {"roughnessFactor", 0.5}, {"metallicFactor", 0.75}}},
         {"extensions", {{"KHR_materials_specular", {{"specularFactor", 0.5}}}}}});
    ASSERT_EQ(s.textures.size(), 1U);
    EXPECT_EQ(s.textures[0].use.content, ImageContent::reflectance);
    // Roughness 0.1; of the rest metal 0.3 and specular 0.5.
    EXPECT_EQ(s.textures[0].texels[0], (std::array<std::uint8_t, 4>{26, 69, 115, 255}));
    EXPECT_EQ(s.layer(Layer::reflectance).ids, (std::vector<std::uint16_t>{0}));
    EXPECT_EQ(s.layer(Layer::reflectance).corners[0], (TextureCorners{{{0, 1}, {1, 1}, {1, 0}}}));
    ASSERT_EQ(s.reflectances.size(), 1U);
    EXPECT_EQ(s.reflectances[0], (Reflectance{0.5, 0.75, 0.5}));
    EXPECT_TRUE(s.texture_ids.empty() && s.colours.empty());
}

TEST(Gltf, ImagesOfSpecularJoinThoseOfRoughness) {
    json material{{"pbrMetallicRoughness",
                   {{"metallicRoughnessTexture", {{"index", 0}}}, {"roughnessFactor", 0.5}, {"metallicFactor", 0.75}}}};
    json &specular = material["extensions"]["KHR_materials_specular"];
    specular = {{"specularFactor", 0.75}, {"specularTexture", {{"index", 0}}}};
    const auto texel_of = [](const Surface &s) {
        return s.layer(Layer::reflectance).ids.empty() ? std::array<std::uint8_t, 4>{}
                                                       : s.textures[s.layer(Layer::reflectance).ids[0]].texels[0];
    };
    // The opacity is 0.8: specular 0.75 x 0.8 of the 0.9 that is not rough.
    EXPECT_EQ(texel_of(with_reflectance(material)), (std::array<std::uint8_t, 4>{26, 69, 138, 255}));
    // The colour is 0, 0.0331 and 0.1329 in linear light; the strongest of the products is that of green.
    specular["specularColorTexture"] = {{"index", 0}};
    specular["specularColorFactor"] = {1, 1, 0.125};
    const Surface s = with_reflectance(material);
    EXPECT_EQ(texel_of(s), (std::array<std::uint8_t, 4>{26, 69, 5, 255}));
    EXPECT_EQ(s.textures.size(), 1U);
    EXPECT_EQ(std::count_if(s.report.begin(), s.report.end(),
                            [](const AttributeReport &line) { return has(line.name, "texture image"); }),
              1);
    EXPECT_FALSE(says(s, "specularColorTexture of materials", Fate::dropped));
    // Alone, beside factors.
    material["pbrMetallicRoughness"].erase("metallicRoughnessTexture");
    specular.erase("specularColorTexture");
    specular.erase("specularColorFactor");
    EXPECT_EQ(texel_of(with_reflectance(material)), (std::array<std::uint8_t, 4>{128, 96, 77, 255}));
}

TEST(Gltf, ImagesOfSpecularThatCannotJoinAreSaid) {
    json material{{"pbrMetallicRoughness", {{"metallicRoughnessTexture", {{"index", 0}}}}}};
    json &specular = material["extensions"]["KHR_materials_specular"];
    specular["specularTexture"] = {{"index", 0}, {"extensions", {{"KHR_texture_transform", {{"scale", {2, 2}}}}}}};
    const Surface apart = with_reflectance(material);
    EXPECT_TRUE(says(apart, "specularTexture of materials", Fate::dropped));
    EXPECT_EQ(apart.layer(Layer::reflectance).ids.size(), 1U);
    specular["specularTexture"] = {{"index", 1}};
    const Surface damaged = with_reflectance(material);
    EXPECT_TRUE(says(damaged, "texture image 'images[1]'", Fate::dropped));
    EXPECT_EQ(damaged.layer(Layer::reflectance).ids.size(), 1U); // of the other image
    specular["specularTexture"] = {{"index", 7}};
    EXPECT_TRUE(says(with_reflectance(material), "specularTexture of materials", Fate::dropped));
    material["pbrMetallicRoughness"].erase("metallicRoughnessTexture");
    specular["specularTexture"] = {{"index", 1}};
    EXPECT_TRUE(with_reflectance(material).textures.empty());
    material["extensions"]["KHR_materials_unlit"] = json::object();
    EXPECT_TRUE(says(with_reflectance(material), "specularTexture of materials", Fate::dropped));
}

// Their reflection has the colour of the surface, so that it is dark where that is.
TEST(Gltf, MetalsTintWhatTheyReflect) {
    const auto material_of = [](const json &metallic) {
        return with_reflectance({{"pbrMetallicRoughness", metallic}}).materials[0];
    };
    EXPECT_EQ(material_of({{"roughnessFactor", 0.5}}).tint, 255);
    EXPECT_EQ(material_of({{"roughnessFactor", 0.5}, {"baseColorFactor", {0.1, 0, 0, 1}}}).environment,
              material_of({{"roughnessFactor", 0.5}}).environment);
    EXPECT_EQ(material_of({{"roughnessFactor", 0.5}, {"metallicFactor", 0}}).tint, 0); // it reflects nothing
    EXPECT_EQ(material_of({{"roughnessFactor", 1}}).tint, 0);
    const Surface glossy =
        with_reflectance({{"extensions", {{"KHR_materials_pbrSpecularGlossiness", {{"specularFactor", {1, 1, 1}}}}}}});
    EXPECT_GT(glossy.materials[0].environment, 0);
    EXPECT_EQ(glossy.materials[0].tint, 0); // its colour is not that of the metal
}

TEST(Gltf, EmissionBesideAColourIsALayer) {
    json material{{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.5, 0.5, 1}}, {"roughnessFactor", 0.25}}},
                  {"emissiveFactor", {1, 0.5, 0.125}},
                  {"emissiveTexture", {{"index", 0}}},
                  {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 2}}}}}};
    const Surface s = with_reflectance(material);
    ASSERT_EQ(s.layer(Layer::emission).ids.size(), 1U);
    const Texture &light = s.textures[s.layer(Layer::emission).ids[0]];
    EXPECT_TRUE(are_colours(light.use.content));
    // 0, 51 and 102 times 2, 1 and 0.25 in linear light.
    EXPECT_EQ(light.texels, (std::vector<std::array<std::uint8_t, 4>>{{0, 51, 51, 255}}));
    EXPECT_EQ(s.layer(Layer::emission).corners[0], (TextureCorners{{{0, 1}, {1, 1}, {1, 0}}}));
    EXPECT_EQ(s.colours[0], (Rgb8{188, 188, 188}));
    EXPECT_TRUE(says(s, "emission beside a colour", Fate::converted));
    // The factors of its reflection are an image too.
    ASSERT_EQ(s.layer(Layer::reflectance).ids.size(), 1U);
    EXPECT_EQ(s.textures[s.layer(Layer::reflectance).ids[0]].texels,
              (std::vector<std::array<std::uint8_t, 4>>{{64, 191, 191, 255}}));
    material["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
    material["pbrMetallicRoughness"]["baseColorFactor"] = {0, 0, 0, 1};
    EXPECT_EQ(with_reflectance(material).layer(Layer::emission).ids.size(), 1U); // black by its factor
    material["emissiveTexture"]["index"] = 1;
    const Surface damaged = with_reflectance(material);
    EXPECT_TRUE(damaged.layer(Layer::emission).ids.empty());
    EXPECT_TRUE(says(damaged, "texture image 'images[1]'", Fate::dropped));
}

TEST(Gltf, EmissionWithoutAnImageLiesEverywhere) {
    json material{{"emissiveFactor", {0.25, 0, 0}}};
    const Surface s = with_reflectance(material);
    ASSERT_EQ(s.layer(Layer::emission).ids.size(), 1U);
    EXPECT_EQ(s.textures[s.layer(Layer::emission).ids[0]].texels,
              (std::vector<std::array<std::uint8_t, 4>>{{137, 0, 0, 255}}));
    EXPECT_TRUE(s.colours.empty()); // those of materials, if nothing replaces these
    EXPECT_TRUE(says(s, "TEXCOORD_0", Fate::dropped));
    material["emissiveFactor"] = {0, 0, 0};
    EXPECT_TRUE(with_reflectance(material).textures.empty());
    material["emissiveTexture"]["index"] = 0;
    EXPECT_TRUE(says(with_reflectance(material), "emissiveTexture of materials", Fate::dropped));
    material["emissiveFactor"] = {1, 1, 1};
    material["extensions"]["KHR_materials_unlit"] = json::object();
    const Surface unlit = with_reflectance(material);
    EXPECT_TRUE(unlit.textures.empty());
    EXPECT_TRUE(says(unlit, "emissiveTexture of materials", Fate::dropped));
    EXPECT_TRUE(says(unlit, "emissiveFactor of materials", Fate::dropped));
}

TEST(Gltf, LayersNeedTheirOwnTextureCoordinatesAlone) {
    json material{{"emissiveFactor", {0.25, 0, 0}}};
    material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", 0}, {"texCoord", 1}}; // there is none
    const Surface lamp = with_reflectance(material);
    ASSERT_EQ(lamp.layer(Layer::emission).ids.size(), 1U);
    ASSERT_EQ(lamp.layer(Layer::reflectance).ids.size(), 1U);
    EXPECT_EQ(lamp.textures[lamp.layer(Layer::reflectance).ids[0]].texels.size(), 1U); // the factors
    material["occlusionTexture"] = {{"index", 0}, {"texCoord", 1}};
    const Surface s = with_reflectance(material);
    EXPECT_TRUE(s.layer(Layer::occlusion).ids.empty());
    EXPECT_TRUE(says(s, "occlusionTexture of materials", Fate::dropped));
    EXPECT_FALSE(says(s, "emissiveTexture of materials", Fate::dropped));
}

TEST(Gltf, EmissionOfPointsIsSaid) {
    Glb glb;
    glb.doc["materials"] = {{{"emissiveFactor", {1, 0, 0}}}};
    glb.show({{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}}, {"mode", 0}, {"material", 0}}});
    const Surface s = surface(glb);
    EXPECT_TRUE(s.layer(Layer::emission).ids.empty() && s.colours.empty());
    EXPECT_TRUE(says(s, "emission of points", Fate::dropped));
}

TEST(Gltf, OcclusionIsTheAmbientLightThatDoesNotArrive) {
    json material{{"occlusionTexture", {{"index", 0}, {"strength", 0.5}}}};
    const Surface s = with_reflectance(material);
    ASSERT_EQ(s.layer(Layer::occlusion).ids.size(), 1U);
    // Red is 0.
    EXPECT_EQ(s.textures[s.layer(Layer::occlusion).ids[0]].texels[0], (std::array<std::uint8_t, 4>{128, 0, 0, 255}));
    EXPECT_EQ(s.layer(Layer::reflectance).ids.size(), 1U);
    EXPECT_TRUE(s.colours.empty());
    EXPECT_FALSE(says(s, "occlusionTexture of materials", Fate::dropped));
    material["extensions"]["KHR_materials_unlit"] = json::object();
    EXPECT_TRUE(says(with_reflectance(material), "occlusionTexture of materials", Fate::dropped));
    material = {{"occlusionTexture", {{"index", 7}}}};
    EXPECT_TRUE(says(with_reflectance(material), "occlusionTexture of materials", Fate::dropped));
}

TEST(Gltf, SpecularAndGlossOfImagesAreKept) {
    json material;
    json &glossy = material["extensions"]["KHR_materials_pbrSpecularGlossiness"];
    glossy = {{"specularGlossinessTexture", {{"index", 0}}}, {"glossinessFactor", 0.5}};
    const Surface s = with_reflectance(material);
    ASSERT_EQ(s.textures.size(), 1U);
    EXPECT_EQ(s.textures[0].texels[0][0], 153); // 1 - 0.5 x 204 / 255
    EXPECT_FALSE(s.textures[0].use.factors.tints);
    glossy = {{"glossinessFactor", 0.5}, {"specularFactor", {0.02, 0, 0}}};
    const Reflectance half = with_reflectance(material).reflectances[0].value();
    EXPECT_EQ(half.roughness, 0.5);
    EXPECT_TRUE(half.tints); // no metal
    EXPECT_EQ(half.metal, 0);
    EXPECT_NEAR(half.specular, 0.5, 1e-6);
    glossy = {{"glossinessFactor", 0.5}, {"specularFactor", {0.9, 0, 0}}};
    EXPECT_FALSE(with_reflectance(material).reflectances[0].value().tints);
    // Without its image, the usual factor would make a mirror.
    glossy = {{"specularGlossinessTexture", {{"index", 1}}}};
    const Surface damaged = with_reflectance(material);
    EXPECT_FALSE(damaged.reflectances[0]);
    EXPECT_EQ(damaged.materials[0].ks, Material{}.ks);
    EXPECT_TRUE(says(damaged, "texture image 'images[1]'", Fate::dropped));
}

TEST(Gltf, UnlitMaterialsHaveNoReflectance) {
    const Surface s = with_reflectance({{"pbrMetallicRoughness", {{"metallicRoughnessTexture", {{"index", 0}}}}},
                                        {"extensions", {{"KHR_materials_unlit", json::object()}}}});
    EXPECT_TRUE(s.textures.empty());
    EXPECT_FALSE(s.reflectances[0]);
    EXPECT_TRUE(says(s, "metallicRoughnessTexture of materials", Fate::dropped));
    EXPECT_EQ(s.materials[0].ka, 1);
}

TEST(Gltf, ImagesOfRoughnessThatCannotBeReadAreSaid) {
    for (const json &texture : {json{{"index", 1}}, json{{"index", 7}}, json::object()}) {
        const Surface s = with_reflectance(
            {{"pbrMetallicRoughness", {{"metallicRoughnessTexture", texture}, {"roughnessFactor", 0.5}}}});
        EXPECT_TRUE(s.layer(Layer::reflectance).ids.empty());
        EXPECT_EQ(std::count_if(s.report.begin(), s.report.end(),
                                [](const AttributeReport &line) { return line.warning == Warning::missing_image; }),
                  1);
        EXPECT_EQ(s.reflectances[0], (Reflectance{0.5, 1, 1})); // the factors count
    }
}

TEST(Gltf, EmissionIsTheColourOfWhatIsBlackOtherwise) {
    Glb glb;
    const Bytes pixels(12, 77);
    const auto positions = glb.floats(kSquare, "VEC3", 3), places = glb.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 2);
    glb.doc["images"] = {
        {{"bufferView", glb.view(png_of(2, 2, PNG_FORMAT_RGB, pixels.data()))}, {"mimeType", "image/png"}}};
    glb.doc["textures"] = {{{"source", 0}}};
    glb.doc["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}}},
                             {"emissiveFactor", {1, 1, 1}},
                             {"emissiveTexture", {{"index", 0}}}}};
    glb.show({{{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", places}}},
               {"indices", glb.indices({0, 1, 2})},
               {"material", 0}}});
    const Surface s = surface(glb);
    ASSERT_EQ(s.textures.size(), 1U);
    EXPECT_EQ(s.texture_ids[0], 0);
    EXPECT_EQ(s.colours[0], (Rgb8{255, 255, 255}));
    EXPECT_EQ(s.materials[0].ka, 1);
    EXPECT_TRUE(says(s, "emission of materials", Fate::converted));
    json &described = glb.doc["materials"][0];
    described["emissiveFactor"] = {0.125, 0.25, 0.5};
    described["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 4;
    EXPECT_EQ(surface(glb).colours[0], (Rgb8{188, 255, 255}));
    described.erase("extensions");
    glb.doc["materials"][0].erase("pbrMetallicRoughness"); // white
    EXPECT_TRUE(surface(glb).texture_ids.empty());
    EXPECT_EQ(surface(glb).layer(Layer::emission).ids.size(), 1U);
}

} // namespace
