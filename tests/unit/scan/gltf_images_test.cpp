// Images of glTF: their places, what they cut, and normal maps.
#include "unit/scan/gltf_files.h"
#include "unit/support/image_files.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

TEST(Gltf, ImagesHaveTheirPlacesAndWraps) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2});
    const auto places = glb.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 2);
    const Bytes pixels(12, 77);
    glb.doc["images"] = {
        {{"bufferView", glb.view(png_of(2, 2, PNG_FORMAT_RGB, pixels.data()))}, {"mimeType", "image/png"}}};
    glb.doc["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}}};
    glb.doc["textures"] = {{{"source", 0}, {"sampler", 0}}};
    glb.doc["materials"] = {
        {{"pbrMetallicRoughness",
          {{"baseColorTexture",
            {{"index", 0},
             {"texCoord", 1},
             {"extensions",
              {{"KHR_texture_transform", {{"offset", {0.5, 0}}, {"scale", {2, 1}}, {"texCoord", 0}}}}}}}}},
         {"doubleSided", true},
         {"extensions", {{"KHR_materials_unlit", json::object()}}}}};
    glb.show(
        {{{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", places}}}, {"indices", indices}, {"material", 0}}});
    const Surface s = surface(glb);
    ASSERT_EQ(s.textures.size(), 1U);
    EXPECT_EQ(s.textures[0].texels[0][0], 77);
    EXPECT_FALSE(s.textures[0].use.is_tinted);
    EXPECT_EQ(s.textures[0].use.wrap, (std::array{Wrap::clamp, Wrap::mirror}));
    EXPECT_EQ(s.texture_corners[0], (TextureCorners{{{0.5F, 1}, {2.5F, 1}, {2.5F, 0}}}));
    EXPECT_EQ(s.materials[0].ka, 1);
    EXPECT_EQ(s.materials[0].kd, 0);
    EXPECT_EQ(std::count_if(s.report.begin(), s.report.end(),
                            [](const AttributeReport &line) { return line.name == "doubleSided materials"; }),
              1);
}

// A square with an image of one texel, in the base colour of a material that `texture` describes.
Surface with_image(const Bytes &image, json texture = {{"index", 0}}, const std::vector<float> &colours = {}) {
    Glb glb;
    json attributes{{"POSITION", glb.floats(kSquare, "VEC3", 3)},
                    {"TEXCOORD_0", glb.floats({1, 0, 0, 1, 0.5F, 0.25F, 0, 0}, "VEC2", 2)},
                    {"TEXCOORD_1", glb.floats({0.5F, 0.5F, 1, 0, 0, 1, 0, 0}, "VEC2", 2)}};
    if (!colours.empty())
        attributes["COLOR_0"] = glb.floats(colours, "VEC3", 3);
    const auto indices = glb.indices({0, 1, 2});
    glb.doc["images"] = {{{"bufferView", glb.view(image)}, {"mimeType", "image/png"}}};
    glb.doc["textures"] = {{{"source", 0}}};
    glb.doc["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", std::move(texture)}}}}};
    glb.show({{{"attributes", attributes}, {"indices", indices}, {"material", 0}}});
    return surface(glb);
}

// Turned against the clock where v points downwards, as the test model of the extension shows it.
TEST(Gltf, TransformsOfTexturesScaleTurnAndMove) {
    const Bytes pixel{1, 2, 3}, image = png_of(1, 1, PNG_FORMAT_RGB, pixel.data());
    const json turned{{"offset", {0.1, 0.2}}, {"rotation", 1.5707963267948966}, {"scale", {2, 3}}};
    const Surface s = with_image(image, {{"index", 0}, {"extensions", {{"KHR_texture_transform", turned}}}});
    const std::array<glm::vec2, 3> expected{{{0.1F, -1.8F}, {3.1F, 0.2F}, {0.85F, -0.8F}}};
    for (std::size_t i = 0; i < 3; ++i)
        EXPECT_LT(glm::distance(s.texture_corners[0][i], expected[i]), 1e-6F) << i;
    // The example of the extension: the lower left quadrant of the image.
    const json quadrant{{"offset", {0, 1}}, {"rotation", 1.5707963267948966}, {"scale", {0.5, 0.5}}};
    const Surface lower = with_image(image, {{"index", 0}, {"extensions", {{"KHR_texture_transform", quadrant}}}});
    const std::array<glm::vec2, 3> left{{{0, 0.5F}, {0.5F, 1}, {0.125F, 0.75F}}};
    for (std::size_t i = 0; i < 3; ++i)
        EXPECT_LT(glm::distance(lower.texture_corners[0][i], left[i]), 1e-6F) << i;
    const Surface second = with_image(image, {{"index", 0}, {"texCoord", 1}});
    EXPECT_EQ(second.texture_corners[0], (TextureCorners{{{0.5F, 0.5F}, {1, 0}, {0, 1}}}));
    json overruled = turned;
    overruled["texCoord"] = 1;
    const Surface third = with_image(image, {{"index", 0}, {"extensions", {{"KHR_texture_transform", overruled}}}});
    EXPECT_LT(glm::distance(third.texture_corners[0][1], glm::vec2(0.1F, -1.8F)), 1e-6F);
}

TEST(Gltf, ColoursOfVerticesMultiplyTheImage) {
    const Bytes pixel{200, 100, 50}, image = png_of(1, 1, PNG_FORMAT_RGB, pixel.data());
    const Surface s = with_image(image, {{"index", 0}}, {0.5F, 0.25F, 1, 1, 1, 1, 0, 0, 0, 1, 1, 1});
    ASSERT_EQ(s.textures.size(), 1U);
    EXPECT_TRUE(s.textures[0].use.is_tinted);
    EXPECT_EQ(s.colours[0], (Rgb8{188, 137, 255})); // linear light as sRGB
    EXPECT_EQ(s.colours[2], (Rgb8{0, 0, 0}));
}

TEST(Gltf, ImagesOfSixteenBitsAreRead) {
    const std::array<std::uint16_t, 3> pixel{0x8000, 0x4000, 0xFFFF};
    const Surface plain = with_image(test::png16_of(1, 1, pixel.data())); // sRGB
    EXPECT_EQ(plain.textures[0].texels[0], (std::array<std::uint8_t, 4>{128, 64, 255, 255}));
    const Surface linear = with_image(png_of(1, 1, PNG_FORMAT_LINEAR_RGB, pixel.data()));
    EXPECT_NEAR(linear.textures[0].texels[0][0], 188, 3); // libpng takes a power for sRGB
    EXPECT_NEAR(linear.textures[0].texels[0][1], 137, 3);
}

// A square whose material has a normal map of one texel: `map` is its JSON, `attributes` are added.
Surface with_normal_map(const json &map, const json &node = json::object(), bool has_tangents = true,
                        std::optional<Bytes> image = {}) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2});
    const auto normals = glb.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3);
    const auto places = glb.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 2);
    const auto others = glb.floats({0, 0.5F, 1, 0.5F, 1, 0, 0, 0}, "VEC2", 2);
    const auto tangents = glb.floats({1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 1}, "VEC4", 4);
    const Bytes pixels{50, 60, 200};
    glb.doc["images"] = {{{"bufferView", glb.view(image ? *image : png_of(1, 1, PNG_FORMAT_RGB, pixels.data()))},
                          {"mimeType", "image/png"}},
                         {{"bufferView", glb.view(Bytes{1, 2, 3})}, {"mimeType", "image/png"}}};
    glb.doc["textures"] = {{{"source", 0}}, {{"source", 1}}};
    glb.doc["materials"] = {{{"normalTexture", map}}};
    json attributes{{"POSITION", positions}, {"NORMAL", normals}, {"TEXCOORD_0", places}, {"TEXCOORD_1", others}};
    if (has_tangents)
        attributes["TANGENT"] = tangents;
    glb.show({{{"attributes", attributes}, {"indices", indices}, {"material", 0}}});
    if (node.is_object())
        glb.doc["nodes"][0].update(node);
    return surface(glb);
}

TEST(Gltf, NormalMapsHaveTheirScalePlacesAndTangents) {
    const json map{{"index", 0}, {"scale", 0.5}, {"texCoord", 1}};
    const Surface s = with_normal_map(map);
    ASSERT_EQ(s.textures.size(), 1U);
    EXPECT_EQ(s.textures[0].texels[0], (std::array<std::uint8_t, 4>{50, 60, 200, 255}));
    EXPECT_EQ(s.textures[0].use.content, ImageContent::normals);
    EXPECT_EQ(s.textures[0].use.relief, 0.5F);
    EXPECT_EQ(s.layer(Layer::normals).ids, (std::vector<std::uint16_t>{0}));
    EXPECT_EQ(s.layer(Layer::normals).corners[0], (TextureCorners{{{0, 0.5F}, {1, 0.5F}, {1, 0}}}));
    EXPECT_TRUE(s.texture_ids.empty() && s.colours.empty());
    EXPECT_EQ(s.tangents, (std::vector<glm::vec4>{{1, 0, 0, 1}, {1, 0, 0, 1}, {0, 0, 0, 0}, {1, 0, 0, 1}}));
    EXPECT_TRUE(says(s, "TANGENT", Fate::kept));
    EXPECT_TRUE(says(s, "TEXCOORD_0", Fate::dropped)); // no image uses it
    EXPECT_TRUE(with_normal_map(map, {}, false).tangents.empty());
    // A turn moves tangents, a mirror reverses their sense.
    const Surface turned = with_normal_map(map, {{"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}});
    EXPECT_NEAR(turned.tangents[0].y, 1, 1e-6);
    EXPECT_EQ(turned.tangents[0].w, 1);
    const Surface mirrored = with_normal_map(map, {{"scale", {-2, 1, 1}}});
    EXPECT_EQ(mirrored.tangents[0], glm::vec4(-1, 0, 0, -1));
    EXPECT_EQ(mirrored.layer(Layer::normals).corners[0], (TextureCorners{{{0, 0.5F}, {1, 0}, {1, 0.5F}}}));
}

// Whatever the image says of its colours.
TEST(Gltf, NumbersOfNormalMapsStayAsTheyAre) {
    const std::array<std::uint16_t, 3> pixel{0x8000, 0x4000, 0xFFFF};
    const Bytes linear = png_of(1, 1, PNG_FORMAT_LINEAR_RGB, pixel.data());
    const Surface s = with_normal_map({{"index", 0}}, {}, true, linear);
    EXPECT_EQ(s.textures[0].texels[0], (std::array<std::uint8_t, 4>{128, 64, 255, 255}));
}

TEST(Gltf, ANormalMapInTheSpaceOfTheObjectIsLeftOut) {
    Bytes pixels;
    for (int i = 0; i < 8; ++i) // a quarter points inwards
        for (const int number : {128, 128, i < 2 ? 0 : 255})
            pixels.push_back(static_cast<std::uint8_t>(number));
    EXPECT_TRUE(
        with_normal_map({{"index", 0}}, {}, true, png_of(8, 1, PNG_FORMAT_RGB, pixels.data())).textures.empty());
    for (std::size_t i = 0; i < 6; ++i) // black background
        pixels[i] = 0;
    EXPECT_EQ(with_normal_map({{"index", 0}}, {}, true, png_of(8, 1, PNG_FORMAT_RGB, pixels.data())).textures.size(),
              1U);
}

TEST(Gltf, CoordinatesOfAnyImageAreUsed) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2});
    const auto places = glb.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 2);
    const Bytes pixels{0, 51, 102, 204};
    glb.doc["images"] = {{{"bufferView", glb.view(png_of(1, 1, PNG_FORMAT_RGBA, pixels.data()))}}};
    glb.doc["textures"] = {{{"source", 0}}};
    glb.doc["materials"] = {json::object(), {{"occlusionTexture", {{"index", 0}}}}};
    json of_plain{{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", places}, {"TEXCOORD_1", places}}},
                  {"indices", indices},
                  {"material", 0}};
    json of_images = of_plain;
    of_images["material"] = 1;
    glb.show({of_plain, of_images});
    const Surface s = surface(glb);
    EXPECT_FALSE(says(s, "TEXCOORD_0", Fate::dropped));
    EXPECT_TRUE(says(s, "TEXCOORD_1", Fate::dropped));
    EXPECT_TRUE(has(note_of(s, "texture coordinates"), "materials and ambient light of points"));
}

TEST(Gltf, ANormalMapThatCannotBeReadIsSaid) {
    for (const json &map : {json{{"index", 1}}, json{{"index", 7}}, json::object()}) {
        const Surface s = with_normal_map(map);
        EXPECT_TRUE(s.textures.empty() && s.layer(Layer::normals).ids.empty() && s.tangents.empty());
        EXPECT_TRUE(std::any_of(s.report.begin(), s.report.end(), [](const AttributeReport &line) {
            return warning_of(line) == Warning::missing_image;
        })) << map.dump();
    }
}

// A square with a material of this mode: its image has these opacities in two texels, or it has none.
Surface with_opacity(const json &material, std::optional<std::array<std::uint8_t, 2>> opacities,
                     const std::vector<float> &colours = {}) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2});
    const auto places = glb.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 2);
    json described = material, attributes{{"POSITION", positions}, {"TEXCOORD_0", places}};
    if (opacities) {
        const Bytes pixels{1, 2, 3, (*opacities)[0], 4, 5, 6, (*opacities)[1]};
        glb.doc["images"] = {
            {{"bufferView", glb.view(png_of(2, 1, PNG_FORMAT_RGBA, pixels.data()))}, {"mimeType", "image/png"}}};
        glb.doc["textures"] = {{{"source", 0}}};
        described["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    }
    if (!colours.empty())
        attributes["COLOR_0"] = glb.floats(colours, "VEC4", 4);
    glb.doc["materials"] = {described};
    glb.show({{{"attributes", attributes}, {"indices", indices}, {"material", 0}}});
    return surface(glb);
}

TEST(Gltf, OpacitiesAreThoseOfFactorImageAndVertices) {
    const std::vector<float> fading{1, 1, 1, 1, 1, 1, 1, 0, 1, 1, 1, 0.5F, 1, 1, 1, 1};
    const json faint{{"baseColorFactor", {1, 1, 1, 0.4}}}, opaque = json::object();
    const auto mask = [](const json &metallic, double cutoff) {
        return json{{"alphaMode", "MASK"}, {"alphaCutoff", cutoff}, {"pbrMetallicRoughness", metallic}};
    };
    const Surface of_image = with_opacity(mask(faint, 0.3), {{255, 100}}, fading);
    ASSERT_EQ(of_image.textures.size(), 1U);
    EXPECT_EQ(of_image.textures[0].use.least_opacity, 0.3F);
    EXPECT_EQ(of_image.textures[0].use.opacity, 0.4F);
    EXPECT_FALSE(of_image.textures[0].use.is_blended);
    EXPECT_EQ(of_image.transparencies, (Bytes{0, 255, 127, 0}));
    // Without an image: an opacity alone.
    for (const Surface &plain : {with_opacity(mask(faint, 0.5), {}), with_opacity(mask(opaque, 0.5), {}, fading)}) {
        ASSERT_EQ(plain.textures.size(), 1U);
        EXPECT_EQ(plain.texture_ids, (std::vector<std::uint16_t>{0}));
        EXPECT_EQ(plain.textures[0].texels, (std::vector<std::array<std::uint8_t, 4>>{{255, 255, 255, 255}}));
        EXPECT_EQ(plain.textures[0].use.least_opacity, 0.5F);
    }
    EXPECT_TRUE(with_opacity(mask(faint, 0.3), {}).textures.empty());
    EXPECT_TRUE(with_opacity(mask(opaque, 0.5), {}).textures.empty());
    // Other modes.
    const json blend{{"alphaMode", "BLEND"}, {"pbrMetallicRoughness", opaque}};
    const Surface blended = with_opacity(blend, {{255, 0}}, fading);
    EXPECT_TRUE(blended.textures[0].use.is_blended);
    EXPECT_EQ(blended.textures[0].use.least_opacity, kUsualAlphaCutoff);
    EXPECT_FALSE(blended.transparencies.empty());
    const Surface glass = with_opacity(blend, {}, fading);
    EXPECT_TRUE(glass.textures.empty());
    const Surface ignored = with_opacity({{"pbrMetallicRoughness", opaque}}, {{255, 0}}, fading);
    EXPECT_EQ(ignored.textures[0].use.least_opacity, 0);
    EXPECT_TRUE(ignored.transparencies.empty());
    // The old kind of materials.
    json glossy{{"alphaMode", "MASK"}};
    glossy["extensions"]["KHR_materials_pbrSpecularGlossiness"]["diffuseFactor"] = {1, 1, 1, 0.2};
    EXPECT_EQ(with_opacity(glossy, {}).textures.size(), 1U);
}

} // namespace
