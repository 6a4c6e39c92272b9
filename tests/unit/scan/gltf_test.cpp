// glTF and GLB: what is read, and that damage is refused.
#include "pbm_scan/gltf/gltf_reader.h"

#include "pbm_format/model/point_values.h"
#include "unit/scan/readings.h"
#include "unit/support/image_files.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <meshoptimizer.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <unistd.h>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using nlohmann::json;

// A GLB under construction: arrays become buffer views and accessors.
class Glb {
  public:
    json doc = {{"asset", {{"version", "2.0"}}}};

    template <class T> std::size_t view(const std::vector<T> &values, std::size_t stride = 0) {
        while (binary_.size() % 4 != 0)
            binary_ += '\0';
        json described{{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", values.size() * sizeof(T)}};
        if (stride != 0)
            described["byteStride"] = stride;
        binary_.append(reinterpret_cast<const char *>(values.data()), values.size() * sizeof(T));
        doc["bufferViews"].push_back(described);
        return doc["bufferViews"].size() - 1;
    }
    std::size_t accessor(json described) {
        doc["accessors"].push_back(std::move(described));
        return doc["accessors"].size() - 1;
    }
    std::size_t floats(const std::vector<float> &values, const char *type, std::size_t components) {
        return accessor({{"bufferView", view(values)},
                         {"componentType", 5126},
                         {"count", values.size() / components},
                         {"type", type}});
    }
    std::size_t indices(const std::vector<std::uint16_t> &values) {
        return accessor(
            {{"bufferView", view(values)}, {"componentType", 5123}, {"count", values.size()}, {"type", "SCALAR"}});
    }
    // A mesh of these primitives, shown by a node.
    void show(json primitives, json node = json::object()) {
        doc["meshes"].push_back({{"primitives", std::move(primitives)}});
        node["mesh"] = doc["meshes"].size() - 1;
        doc["nodes"].push_back(std::move(node));
        doc["scenes"][0]["nodes"].push_back(doc["nodes"].size() - 1);
    }
    const std::string &binary() const { return binary_; }
    std::string file() const {
        json whole = doc;
        if (!whole.contains("buffers"))
            whole["buffers"].push_back({{"byteLength", binary_.size()}});
        std::string text = whole.dump(), binary = binary_;
        text.resize((text.size() + 3) / 4 * 4, ' ');
        binary.resize((binary.size() + 3) / 4 * 4, '\0');
        const auto word = [](std::size_t value) {
            const auto bits = static_cast<std::uint32_t>(value);
            return std::string(reinterpret_cast<const char *>(&bits), 4);
        };
        return "glTF" + word(2) + word(28 + text.size() + binary.size()) + word(text.size()) + "JSON" + text +
               word(binary.size()) + std::string("BIN\0", 4) + binary;
    }

  private:
    std::string binary_;
};

Result<Surface> read(const std::string &file) { return test::read(file, "scan.glb"); }
Surface surface(const Glb &glb) { return test::surface(glb.file(), "scan.glb"); }
std::string refusal(const Glb &glb) { return test::error(glb.file(), "scan.glb").message; }
bool says(const Surface &s, const std::string &name, Fate fate) {
    return std::any_of(s.report.begin(), s.report.end(),
                       [&](const AttributeReport &line) { return line.name == name && line.fate == fate; });
}

const std::vector<float> kSquare{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};

TEST(Gltf, ModesOfTriangles) {
    const auto with = [](int mode, const std::vector<std::uint16_t> &corners) {
        Glb glb;
        const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices(corners);
        glb.show({{{"attributes", {{"POSITION", positions}}}, {"indices", indices}, {"mode", mode}}});
        return surface(glb).triangles;
    };
    const std::vector<glm::uvec3> halves{{0, 1, 2}, {0, 2, 3}};
    EXPECT_EQ(with(4, {0, 1, 2, 0, 2, 3}), halves);
    EXPECT_EQ(with(5, {1, 2, 0, 3}), (std::vector<glm::uvec3>{{1, 2, 0}, {0, 2, 3}}));
    EXPECT_EQ(with(6, {0, 1, 2, 3}), halves);
    Glb plain; // without indices
    plain.show({{{"attributes", {{"POSITION", plain.floats({0, 0, 0, 1, 0, 0, 1, 1, 0}, "VEC3", 3)}}}}});
    EXPECT_EQ(surface(plain).triangles, (std::vector<glm::uvec3>{{0, 1, 2}}));
}

TEST(Gltf, ColoursOfBytesAreScaledForAllPrimitives) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2, 0, 2, 3});
    const auto primitive = [&](std::size_t colours) {
        return json{{"attributes", {{"POSITION", positions}, {"COLOR_0", colours}}}, {"indices", indices}};
    };
    const auto colours = glb.floats({255, 102, 0, 255, 102, 51, 255, 255, 102, 51, 255, 255}, "VEC3", 3);
    const auto dark = glb.floats({1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0}, "VEC3", 3);
    Glb usual = glb;
    glb.show({primitive(dark), primitive(colours)});
    const Surface s = surface(glb);
    const auto srgb = [](double linear) { return linear_to_srgb(static_cast<std::uint32_t>(linear * 65535 + 0.5)); };
    EXPECT_EQ(s.colours[0], (Rgb8{srgb(1 / 255.0), 0, 0})) << "in the range of all";
    EXPECT_EQ(s.colours[4], (Rgb8{255, srgb(0.4), 0}));
    EXPECT_EQ(test::note_of(s, "COLOR_0"),
              "in 0..255, not in 0..1 as glTF has them; sRGB, 8 bits, times the material's factor");
    usual.show({primitive(dark)});
    EXPECT_EQ(surface(usual).colours[0], (Rgb8{255, 0, 0}));

    // Bytes that are not declared as fractions, and factors of materials.
    Glb bytes;
    const auto place = bytes.floats(kSquare, "VEC3", 3);
    const std::vector<std::uint8_t> raw(16, 51);
    const auto accessor =
        bytes.accessor({{"bufferView", bytes.view(raw)}, {"componentType", 5121}, {"count", 4}, {"type", "VEC4"}});
    bytes.show({{{"attributes", {{"POSITION", place}, {"COLOR_0", accessor}}}, {"indices", bytes.indices({0, 1, 2})}}});
    EXPECT_EQ(surface(bytes).colours[0], (Rgb8{srgb(0.2), srgb(0.2), srgb(0.2)}));
    Glb factor;
    const auto corners = factor.floats(kSquare, "VEC3", 3), triangle = factor.indices({0, 1, 2});
    factor.show({{{"attributes", {{"POSITION", corners}}}, {"indices", triangle}, {"material", 0}}});
    factor.doc["materials"] = {{{"pbrMetallicRoughness", {{"baseColorFactor", {255, 102, 0, 1}}}}}};
    EXPECT_EQ(surface(factor).materials.front().colour, (Rgb8{255, srgb(0.4), 0}));
    EXPECT_TRUE(says(surface(factor), "factors of colours", Fate::converted));
}

TEST(Gltf, TrianglesWithoutNormalsAreFacets) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2, 0, 2, 3}),
               normals = glb.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3);
    const json with{{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}}, {"indices", indices}},
        without{{"attributes", {{"POSITION", positions}}}, {"indices", indices}},
        points{{"attributes", {{"POSITION", positions}}}, {"mode", 0}};
    const auto has_facets = [&](const json &primitives) {
        Glb shown = glb;
        shown.show(primitives);
        return surface(shown).has_facets;
    };
    EXPECT_TRUE(has_facets(json::array({without})));
    EXPECT_TRUE(has_facets(json::array({with, without})));
    EXPECT_FALSE(has_facets(json::array({with})));
    EXPECT_FALSE(has_facets(json::array({with, points})));
}

TEST(Gltf, DamagedIndicesAreNotAbsentOnes) {
    const auto primitive = [](Glb &glb) {
        return json{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}}};
    };
    for (const json &damaged : {json(-1), json(0.5), json("1"), json(1e300)}) {
        Glb glb;
        json with_indices = primitive(glb), without_places = with_indices;
        with_indices["indices"] = damaged;
        without_places["attributes"]["POSITION"] = damaged;
        for (const json &wrong : {with_indices, without_places}) {
            Glb copy = glb;
            copy.show({wrong});
            EXPECT_TRUE(test::has(refusal(copy), "does not exist")) << wrong;
        }
        glb.show({with_indices}, {{"children", {damaged}}});
        EXPECT_TRUE(test::has(refusal(glb), "does not exist"));
    }
    Glb whole; // an integer all the same
    json shown = primitive(whole);
    shown["mode"] = 4.0;
    whole.show({shown, {{"attributes", json::object()}}});
    EXPECT_EQ(surface(whole).positions.size(), 4U);
    EXPECT_TRUE(says(surface(whole), "primitives without POSITION", Fate::dropped));
}

TEST(Gltf, NodesMoveTurnAndMirror) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3),
               normals = glb.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3), indices = glb.indices({0, 1, 2});
    const json primitive{{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}}, {"indices", indices}};
    glb.show({primitive}, {{"translation", {10, 0, 0}}, {"scale", {2, 2, 2}}});
    glb.doc["nodes"].push_back({{"mesh", 0}, {"scale", {-1, 1, 1}}});
    glb.doc["nodes"].push_back({{"children", {1}}, {"rotation", {0, 0, 0.70710678, 0.70710678}}});
    glb.doc["nodes"].push_back({{"mesh", 0}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1}}});
    glb.doc["scenes"][0]["nodes"] = {0, 2, 3};
    const Surface s = surface(glb);
    ASSERT_EQ(s.positions.size(), 12U);
    EXPECT_EQ(s.positions[2], glm::dvec3(12, 2, 0));
    EXPECT_NEAR(s.positions[6].x, -1, 1e-6); // (-1, 1) turned by 90 degrees
    EXPECT_NEAR(s.positions[6].y, -1, 1e-6);
    EXPECT_EQ(s.triangles[1], glm::uvec3(4, 6, 5)) << "a mirrored face is wound the other way";
    EXPECT_EQ(s.positions[8], glm::dvec3(0, 0, 5));
    EXPECT_EQ(s.normals[6], glm::vec3(0, 0, 1));
}

TEST(Gltf, ColoursAreFactorTimesThoseOfVertices) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2, 0, 2, 3});
    const auto colours = glb.accessor(
        {{"bufferView",
          glb.view(std::vector<std::uint8_t>{255, 255, 0, 255, 255, 255, 0, 255, 255, 255, 0, 255, 255, 255, 0, 255})},
         {"componentType", 5121},
         {"normalized", true},
         {"count", 4},
         {"type", "VEC4"}});
    glb.doc["materials"] = {{{"pbrMetallicRoughness",
                              {{"baseColorFactor", {0.5, 1, 1, 1}}, {"roughnessFactor", 0.5}, {"metallicFactor", 0}}}}};
    glb.show(
        {{{"attributes", {{"POSITION", positions}, {"COLOR_0", colours}}}, {"indices", indices}, {"material", 0}}});
    const Surface s = surface(glb);
    EXPECT_EQ(s.colours, std::vector<Rgb8>(4, Rgb8{188, 255, 0}));
    ASSERT_EQ(s.materials.size(), 1U);
    EXPECT_FLOAT_EQ(s.materials[0].ks, 0.05F);
    EXPECT_FLOAT_EQ(s.materials[0].power, 30);
    EXPECT_TRUE(says(s, "COLOR_0", Fate::converted));
}

TEST(Gltf, ImagesHaveTheirPlacesAndWraps) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2});
    const auto places = glb.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 2);
    const Bytes pixels(12, 77);
    glb.doc["images"] = {
        {{"bufferView", glb.view(test::png_of(2, 2, PNG_FORMAT_RGB, pixels.data()))}, {"mimeType", "image/png"}}};
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
    const Bytes pixel{1, 2, 3}, image = test::png_of(1, 1, PNG_FORMAT_RGB, pixel.data());
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
    const Bytes pixel{200, 100, 50}, image = test::png_of(1, 1, PNG_FORMAT_RGB, pixel.data());
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
    const Surface linear = with_image(test::png_of(1, 1, PNG_FORMAT_LINEAR_RGB, pixel.data()));
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
    glb.doc["images"] = {{{"bufferView", glb.view(image ? *image : test::png_of(1, 1, PNG_FORMAT_RGB, pixels.data()))},
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
    const Bytes linear = test::png_of(1, 1, PNG_FORMAT_LINEAR_RGB, pixel.data());
    const Surface s = with_normal_map({{"index", 0}}, {}, true, linear);
    EXPECT_EQ(s.textures[0].texels[0], (std::array<std::uint8_t, 4>{128, 64, 255, 255}));
}

TEST(Gltf, ANormalMapInTheSpaceOfTheObjectIsLeftOut) {
    Bytes pixels;
    for (int i = 0; i < 8; ++i) // a quarter points inwards
        for (const int number : {128, 128, i < 2 ? 0 : 255})
            pixels.push_back(static_cast<std::uint8_t>(number));
    EXPECT_TRUE(
        with_normal_map({{"index", 0}}, {}, true, test::png_of(8, 1, PNG_FORMAT_RGB, pixels.data())).textures.empty());
    for (std::size_t i = 0; i < 6; ++i) // black background
        pixels[i] = 0;
    EXPECT_EQ(
        with_normal_map({{"index", 0}}, {}, true, test::png_of(8, 1, PNG_FORMAT_RGB, pixels.data())).textures.size(),
        1U);
}

// A square whose material is `material`; its images 0 and 1 are one texel, {0, 51, 102, 204}, and no image.
Surface with_reflectance(const json &material) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2});
    const auto places = glb.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 2);
    const Bytes pixels{0, 51, 102, 204};
    glb.doc["images"] = {{{"bufferView", glb.view(test::png_of(1, 1, PNG_FORMAT_RGBA, pixels.data()))}},
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

TEST(Gltf, CoordinatesOfAnyImageAreUsed) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2});
    const auto places = glb.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 2);
    const Bytes pixels{0, 51, 102, 204};
    glb.doc["images"] = {{{"bufferView", glb.view(test::png_of(1, 1, PNG_FORMAT_RGBA, pixels.data()))}}};
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

TEST(Gltf, CamerasBecomeViews) {
    Glb glb;
    glb.show({{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}}, {"indices", glb.indices({0, 1, 2})}}},
             {{"name", "sheet"}});
    glb.show({{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}}, {"indices", glb.indices({0, 1, 2})}}},
             {{"name", "sheet"}});
    const auto add = [&](const json &node) {
        glb.doc["nodes"].push_back(node);
        glb.doc["scenes"][0]["nodes"].push_back(glb.doc["nodes"].size() - 1);
    };
    glb.doc["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.6}, {"znear", 0.1}}}},
                          {{"type", "orthographic"}, {"name", "plan"}, {"orthographic", {{"ymag", 2}}}},
                          {{"type", "perspective"}, {"perspective", {{"yfov", 7}}}}};
    add({{"camera", 0}, {"name", "front"}, {"translation", {0.5, 0.5, 3}}});
    add({{"camera", 1}, {"translation", {0.5, 5, 0}}, {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}});
    add({{"camera", 2}, {"translation", {0, 0, 3}}});
    add({{"camera", 9}});
    const Surface s = surface(glb);
    ASSERT_EQ(s.views.size(), 2U);
    EXPECT_EQ(s.views[0].name, "front");
    EXPECT_EQ(s.views[0].position, glm::dvec3(0.5, 0.5, 3));
    EXPECT_LT(glm::distance(s.views[0].focal_point, glm::dvec3(0.5, 0.5, 0)), 1e-9);
    EXPECT_EQ(s.views[0].up, glm::dvec3(0, 1, 0));
    EXPECT_EQ(s.views[0].view_angle, 0.6);
    EXPECT_FALSE(s.views[0].is_orthographic);
    EXPECT_EQ(s.views[1].name, "plan"); // from above
    const double distance = glm::distance(s.views[1].focal_point, glm::dvec3(0.5, 5, 0));
    EXPECT_LT(glm::distance(s.views[1].focal_point, glm::dvec3(0.5, 5 - distance, 0)), 1e-9);
    EXPECT_LT(glm::distance(s.views[1].up, glm::dvec3(0, 0, -1)), 1e-9);
    EXPECT_NEAR(std::tan(s.views[1].view_angle / 2) * distance, 2, 1e-9);
    EXPECT_TRUE(s.views[1].is_orthographic);
    EXPECT_EQ(s.part_names, (std::vector<std::string>{"sheet"}));
    EXPECT_TRUE(says(s, "cameras", Fate::kept));
    EXPECT_TRUE(says(s, "damaged cameras", Fate::dropped));
    EXPECT_TRUE(says(s, "names of nodes", Fate::kept));
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
            {{"bufferView", glb.view(test::png_of(2, 1, PNG_FORMAT_RGBA, pixels.data()))}, {"mimeType", "image/png"}}};
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

TEST(Gltf, SparseQuantisedAndInterleavedAccessors) {
    Glb glb;
    // Integers of 16 bits with a stride of 8: KHR_mesh_quantization.
    const auto quantised = glb.accessor(
        {{"bufferView", glb.view(std::vector<std::int16_t>{0, 0, 0, 9, 32767, 0, 0, 9, 0, -32768, 0, 9}, 8)},
         {"componentType", 5122},
         {"normalized", true},
         {"count", 3},
         {"type", "VEC3"}});
    glb.show({{{"attributes", {{"POSITION", quantised}}}}});
    const json sparse{{"count", 1},
                      {"indices", {{"bufferView", glb.view(std::vector<std::uint8_t>{2})}, {"componentType", 5121}}},
                      {"values", {{"bufferView", glb.view(std::vector<float>{7, 8, 9})}}}};
    const auto zeros = glb.accessor({{"componentType", 5126}, {"count", 3}, {"type", "VEC3"}, {"sparse", sparse}});
    glb.show({{{"attributes", {{"POSITION", zeros}}}, {"mode", 0}}});
    const Surface s = surface(glb);
    ASSERT_EQ(s.positions.size(), 6U);
    EXPECT_EQ(s.positions[1], glm::dvec3(1, 0, 0));
    EXPECT_EQ(s.positions[2], glm::dvec3(0, -1, 0));
    EXPECT_EQ(s.positions[4], glm::dvec3(0));
    EXPECT_EQ(s.positions[5], glm::dvec3(7, 8, 9));
    EXPECT_EQ(s.points_beside_triangles, 3U);
}

TEST(Gltf, MeshoptIsUnpacked) {
    Glb glb;
    std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(4, 12));
    packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), kSquare.data(), 4, 12));
    const std::vector<unsigned int> corners{0, 1, 2, 0, 2, 3};
    std::vector<unsigned char> packed_corners(meshopt_encodeIndexBufferBound(6, 4));
    packed_corners.resize(meshopt_encodeIndexBuffer(packed_corners.data(), packed_corners.size(), corners.data(), 6));
    const auto compressed = [&glb](std::size_t view, std::size_t stride, std::size_t count, const char *mode) {
        json &described = glb.doc["bufferViews"][view];
        described["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0},
                                                              {"byteOffset", described["byteOffset"]},
                                                              {"byteLength", described["byteLength"]},
                                                              {"byteStride", stride},
                                                              {"count", count},
                                                              {"mode", mode}};
        return view;
    };
    const auto positions = glb.accessor({{"bufferView", compressed(glb.view(packed), 12, 4, "ATTRIBUTES")},
                                         {"componentType", 5126},
                                         {"count", 4},
                                         {"type", "VEC3"}});
    const auto indices = glb.accessor({{"bufferView", compressed(glb.view(packed_corners), 4, 6, "TRIANGLES")},
                                       {"componentType", 5125},
                                       {"count", 6},
                                       {"type", "SCALAR"}});
    glb.show({{{"attributes", {{"POSITION", positions}}}, {"indices", indices}}});
    glb.doc["extensionsRequired"] = {"EXT_meshopt_compression"};
    const Surface s = surface(glb);
    EXPECT_EQ(s.positions[2], glm::dvec3(1, 1, 0));
    EXPECT_EQ(s.triangles.size(), 2U);
    glb.doc["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["byteLength"] = packed.size() - 1;
    EXPECT_NE(refusal(glb).find("are damaged"), std::string::npos);
    glb.doc["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["count"] = 4'000'000'000U;
    EXPECT_NE(refusal(glb).find("more elements than its compressed bytes can hold"), std::string::npos);
}

// The filter COLOR: luma, two differences and opacity, here of 4 bits.
TEST(Gltf, MeshoptColoursAreUnpacked) {
    Glb glb;
    const std::vector<std::uint8_t> colours{9, 4, 254, 15, 15, 0, 0, 14, 0, 0, 0, 8}; // y, co, cg, opacity
    std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(3, 4));
    packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), colours.data(), 3, 4));
    const auto view = glb.view(packed);
    glb.doc["bufferViews"][view]["extensions"]["KHR_meshopt_compression"] = {
        {"buffer", 0},          {"byteOffset", 0},  {"byteLength", packed.size()}, {"byteStride", 4}, {"count", 3},
        {"mode", "ATTRIBUTES"}, {"filter", "COLOR"}};
    const auto accessor = glb.accessor(
        {{"bufferView", view}, {"componentType", 5121}, {"normalized", true}, {"count", 3}, {"type", "VEC4"}});
    const auto positions = glb.floats({0, 0, 0, 1, 0, 0, 1, 1, 0}, "VEC3", 3);
    glb.show({{{"attributes", {{"POSITION", positions}, {"COLOR_0", accessor}}}}});
    const Surface s = surface(glb);
    const auto srgb = [](int linear) { return linear_to_srgb(static_cast<std::uint32_t>(linear * 257)); };
    EXPECT_EQ(s.colours[0], (Rgb8{srgb(255), srgb(7 * 17), srgb(7 * 17)})); // 9 + 4 + 2, 9 - 2, 9 - 4 + 2
    EXPECT_EQ(s.colours[1], (Rgb8{255, 255, 255}));
    EXPECT_EQ(s.colours[2], (Rgb8{0, 0, 0}));
}

TEST(Gltf, PointsWithIndicesAreThoseAlone) {
    Glb glb;
    glb.show({{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}},
               {"indices", glb.indices({2, 1, 2})},
               {"mode", 0}}});
    EXPECT_EQ(surface(glb).positions, (std::vector<glm::dvec3>{{1, 1, 0}, {1, 0, 0}}));
}

TEST(Gltf, QuaternionsAreNormalised) {
    Glb glb;
    glb.show({{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}}, {"indices", glb.indices({0, 1, 2})}}},
             {{"rotation", {0, 0, 0.5, 0.5}}});
    const Surface s = surface(glb);
    EXPECT_NEAR(s.positions[1].y, 1, 1e-12);
    EXPECT_TRUE(says(s, "rotations", Fate::converted));
}

TEST(Gltf, WhatTheDefaultSceneDoesNotShowIsNamed) {
    Glb glb;
    const json primitive{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}},
                         {"indices", glb.indices({0, 1, 2})}};
    glb.show({primitive});
    glb.show({primitive}, {{"translation", {5, 0, 0}}});
    glb.doc["scenes"] = {{{"nodes", {0}}, {"name", "old"}}, {{"nodes", {1}}}};
    glb.doc["scene"] = 1;
    glb.doc["extensionsUsed"] = {"KHR_lights_punctual", "KHR_materials_unlit"};
    const Surface s = surface(glb);
    EXPECT_EQ(s.positions[0], glm::dvec3(5, 0, 0));
    EXPECT_TRUE(says(s, "scenes 'old'", Fate::dropped));
    EXPECT_TRUE(says(s, "meshes 0", Fate::dropped));
    EXPECT_TRUE(says(s, "extension 'KHR_lights_punctual'", Fate::dropped));
    EXPECT_FALSE(says(s, "extension 'KHR_materials_unlit'", Fate::dropped));
    glb.doc["nodes"][1]["extensions"]["KHR_node_visibility"]["visible"] = false;
    glb.doc["scenes"][1]["nodes"] = {0, 1};
    EXPECT_EQ(surface(glb).triangles.size(), 1U);
    EXPECT_TRUE(says(surface(glb), "hidden nodes", Fate::kept));
}

TEST(Gltf, JointsMoveASkinAndItsNodeDoesNot) {
    Glb glb;
    const auto joints = glb.accessor(
        {{"bufferView", glb.view(std::vector<std::uint8_t>{0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0})},
         {"componentType", 5121},
         {"count", 4},
         {"type", "VEC4"}});
    const auto weights = glb.floats({1, 0, 0, 0, 0, 1, 0, 0, 0.5, 0.5, 0, 0, 2, 2, 0, 0}, "VEC4", 4);
    const std::vector<float> identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    std::vector<float> both = identity;
    both.insert(both.end(), identity.begin(), identity.end());
    both[16 + 12] = 1; // the second inverse bind matrix moves by x
    glb.show(
        {{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}, {"JOINTS_0", joints}, {"WEIGHTS_0", weights}}},
          {"indices", glb.indices({0, 1, 2, 0, 2, 3})}}},
        {{"scale", {100, 100, 100}}, {"skin", 0}});
    glb.doc["nodes"].push_back({{"scale", {0.5, 0.5, 0.5}}, {"children", {2}}});
    glb.doc["nodes"].push_back({{"translation", {0, 0, 4}}});
    glb.doc["skins"] = {{{"joints", {1, 2}}, {"inverseBindMatrices", glb.floats(both, "MAT4", 16)}}};
    const Surface s = surface(glb);
    EXPECT_EQ(s.positions[0], glm::dvec3(0));
    EXPECT_EQ(s.positions[1], glm::dvec3(1, 0, 2)); // 0.5 ((1, 0, 0) + (1, 0, 0) + (0, 0, 4))
    EXPECT_EQ(s.positions[2], glm::dvec3(0.75, 0.5, 1));
    EXPECT_EQ(s.positions[3], glm::dvec3(0.25, 0.5, 1));
    EXPECT_TRUE(says(s, "skins", Fate::kept));
    glb.doc["skins"][0]["joints"] = {1, 9};
    EXPECT_TRUE(test::has(refusal(glb), "a joint is no node"));
}

TEST(Gltf, MorphTargetsAndInstancesAreApplied) {
    Glb glb;
    const auto target = glb.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3);
    glb.show({{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}},
               {"indices", glb.indices({0, 1, 2})},
               {"targets", {{{"POSITION", target}}, {{"POSITION", target}}}}}});
    EXPECT_TRUE(says(surface(glb), "morph targets", Fate::dropped));
    glb.doc["meshes"][0]["weights"] = {0.5, 0};
    EXPECT_EQ(surface(glb).positions[1], glm::dvec3(1, 0, 0.5));
    EXPECT_TRUE(says(surface(glb), "morph targets", Fate::converted));
    glb.doc["nodes"][0]["weights"] = {0, 2};
    glb.doc["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
        {"TRANSLATION", glb.floats({7, 0, 0, 0, 7, 0}, "VEC3", 3)},
        {"SCALE", glb.floats({1, 1, 1, 2, 2, 2}, "VEC3", 3)}};
    const Surface s = surface(glb);
    ASSERT_EQ(s.positions.size(), 8U);
    EXPECT_EQ(s.positions[1], glm::dvec3(8, 0, 2));
    EXPECT_EQ(s.positions[5], glm::dvec3(2, 7, 4));
}

TEST(Gltf, VerticesOfSharedAccessorsAreThereWhereTheyAreNamed) {
    Glb glb;
    std::vector<float> many(3 * 1000);
    for (std::size_t i = 0; i < many.size(); ++i)
        many[i] = static_cast<float>(i * i % 1009);
    const auto positions = glb.floats(many, "VEC3", 3);
    json primitives;
    for (std::uint16_t i = 0; i < 250; ++i)
        primitives.push_back(
            {{"attributes", {{"POSITION", positions}}},
             {"indices", glb.indices({i, static_cast<std::uint16_t>(i + 1), static_cast<std::uint16_t>(i + 2)})}});
    glb.show(primitives);
    const Surface s = surface(glb);
    EXPECT_EQ(s.triangles.size(), 250U);
    EXPECT_EQ(s.positions.size(), 750U);
    EXPECT_EQ(s.positions[s.triangles[99].y], glm::dvec3(many[300], many[301], many[302]));
    EXPECT_EQ(test::note_of(s, "vertices"), "748 that no primitive names left out");
    glb.doc["accessors"][positions]["count"] = 4000000000U; // no memory is allocated for it
    EXPECT_TRUE(test::has(refusal(glb), "announces 4000000000 elements"));
}

TEST(Gltf, AccessorsMayNotWantMoreNumbersThanTheFileCanHold) {
    Glb glb;
    json primitives;
    for (int i = 0; i < 8; ++i) // without data each
        primitives.push_back(
            {{"attributes",
              {{"POSITION", glb.accessor({{"componentType", 5126}, {"count", 8000000}, {"type", "VEC3"}})}}},
             {"mode", 0}});
    glb.show(primitives);
    EXPECT_EQ(test::error(glb.file(), "scan.glb").code, ErrorCode::too_large);
}

TEST(Gltf, EmissionIsTheColourOfWhatIsBlackOtherwise) {
    Glb glb;
    const Bytes pixels(12, 77);
    const auto positions = glb.floats(kSquare, "VEC3", 3), places = glb.floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2", 2);
    glb.doc["images"] = {
        {{"bufferView", glb.view(test::png_of(2, 2, PNG_FORMAT_RGB, pixels.data()))}, {"mimeType", "image/png"}}};
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

TEST(Gltf, BytesThatFillOrFollowAreNoReasonToRefuse) {
    Glb glb;
    glb.show({{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}}, {"indices", glb.indices({0, 1, 2})}}});
    for (int i = 0; i < 4; ++i, glb.doc["asset"]["generator"] = std::string(static_cast<std::size_t>(i), 'x')) {
        std::string file = glb.file();
        std::uint32_t length = 0;
        std::memcpy(&length, file.data() + 12, 4);
        while (file[20 + length - 1] == ' ')
            --length;
        std::memcpy(file.data() + 12, &length, 4); // without the blanks that fill the JSON
        const Result<Surface> s = read(file);
        ASSERT_TRUE(s) << s.error().message;
        EXPECT_EQ(says(*s, "chunks", Fate::converted), length % 4 != 0);
    }
    EXPECT_EQ(test::note_of(*read(glb.file() + "garbage"), "end of file"), "7 bytes behind the GLB file");
}

TEST(Gltf, FilesBesideIt) {
    const std::filesystem::path folder =
        std::filesystem::path(testing::TempDir()) / ("pbm_gltf_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    Glb glb;
    glb.show({{{"attributes", {{"POSITION", glb.floats({0, 0, 0, 1, 0, 0, 1, 1, 0}, "VEC3", 3)}}}}});
    glb.doc["buffers"] = {{{"uri", "my%20data.bin"}, {"byteLength", glb.binary().size()}}};
    std::ofstream(folder / "my data.bin") << glb.binary();
    const std::string path = (folder / "scan.gltf").string();
    std::ofstream(path) << glb.doc.dump();
    const std::vector<NamedFile> named = further_files(path);
    ASSERT_EQ(named.size(), 1U);
    EXPECT_EQ(named[0].name, "my%20data.bin");
    EXPECT_EQ(named[0].file, (folder / "my data.bin").string());
    EXPECT_EQ(named[0].place, named[0].file);
    Result<Surface> s = read_surface(path, {});
    ASSERT_TRUE(s.ok()) << s.error().message;
    EXPECT_EQ(s->triangles.size(), 1U);
    std::filesystem::resize_file(folder / "my data.bin", 35);
    s = read_surface(path, {});
    ASSERT_FALSE(s.ok());
    EXPECT_NE(s.error().message.find("buffers[0] announces 36 bytes and has 35"), std::string::npos)
        << s.error().message;
    std::filesystem::remove(folder / "my data.bin");
    EXPECT_NE(read_surface(path, {}).error().message.find("there is no file 'my%20data.bin'"), std::string::npos);
    glb.doc["buffers"][0]["uri"] =
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8AAAAA";
    std::ofstream(path) << glb.doc.dump();
    s = read_surface(path, {});
    ASSERT_TRUE(s.ok()) << s.error().message;
    EXPECT_EQ(s->positions[2], glm::dvec3(1, 1, 0));
    std::filesystem::remove_all(folder);
}

TEST(Gltf, EveryCutAndWrongReferenceIsRefused) {
    Glb glb;
    const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2, 0, 2, 3});
    glb.show({{{"attributes", {{"POSITION", positions}}}, {"indices", indices}}});
    const std::string file = glb.file();
    for (std::size_t size = 4; size < file.size(); ++size)
        EXPECT_FALSE(read(file.substr(0, size)).ok()) << size;
    const auto changed = [&glb](const char *pointer, const json &value) {
        Glb other = glb;
        other.doc[json::json_pointer(pointer)] = value;
        return refusal(other);
    };
    const auto has = [](const std::string &text, const char *part) { return text.find(part) != std::string::npos; };
    EXPECT_TRUE(has(changed("/accessors/0/count", 5), "announces 5 elements, but its buffer view holds 4"));
    EXPECT_TRUE(has(changed("/accessors/0/bufferView", 9), "bufferViews[9] does not exist"));
    EXPECT_TRUE(has(changed("/accessors/0/type", "VEC9"), "no type that glTF knows"));
    EXPECT_TRUE(has(changed("/bufferViews/0/byteLength", 1000), "beyond the end of its buffer"));
    EXPECT_TRUE(has(changed("/meshes/0/primitives/0/attributes/POSITION", 7), "accessors[7] does not exist"));
    EXPECT_TRUE(has(changed("/meshes/0/primitives/0/mode", 9), "mode 9"));
    EXPECT_TRUE(has(changed("/nodes/0/mesh", 3), "meshes[3] does not exist"));
    EXPECT_TRUE(has(changed("/nodes/0/children", {0}), "child of itself"));
    EXPECT_TRUE(has(changed("/scenes/0/nodes", {8}), "nodes[8] does not exist"));
    EXPECT_TRUE(has(changed("/asset/version", "1.0"), "glTF 1"));
    EXPECT_TRUE(has(changed("/extensionsRequired", {"EXT_unknown"}), "requires 'EXT_unknown'"));
    Glb beyond;
    const auto few = beyond.floats({0, 0, 0, 1, 0, 0, 1, 1, 0}, "VEC3", 3), four = beyond.indices({0, 1, 3});
    beyond.show({{{"attributes", {{"POSITION", few}}}, {"indices", four}}});
    EXPECT_TRUE(has(refusal(beyond), "meshes[0].primitives[0]: vertex index 3, but there are 3 vertices"));
}

// The second splat is faint, the node doubles and turns: the shortest axis, x, becomes y.
TEST(Gltf, GaussianSplatsAreDiscs) {
    Glb glb;
    const auto positions = glb.floats({1, 0, 0, 5, 5, 5, 0, 0, 1}, "VEC3", 3);
    const auto rotations = glb.floats({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, "VEC4", 4);
    const auto opacities = glb.floats({1, 0.1F, 0.9F}, "SCALAR", 1);
    const auto coefficients = glb.floats({0, 0, 0, 0, 0, 0, 9, -9, 0}, "VEC3", 3);
    const auto file_with = [&](const std::vector<float> &scales) {
        Glb file = glb;
        const auto scale = file.floats(scales, "VEC3", 3);
        file.show({{{"mode", 0},
                    {"attributes",
                     {{"POSITION", positions},
                      {"KHR_gaussian_splatting:ROTATION", rotations},
                      {"KHR_gaussian_splatting:SCALE", scale},
                      {"KHR_gaussian_splatting:OPACITY", opacities},
                      {"KHR_gaussian_splatting:SH_DEGREE_0_COEF_0", coefficients}}},
                    {"extensions", {{"KHR_gaussian_splatting", json::object()}}}}},
                  {{"scale", {2, 2, 2}}, {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}});
        file.doc["extensionsUsed"] = {"KHR_gaussian_splatting"};
        return file.file();
    };
    const auto read_with = [&](const std::vector<float> &scales) {
        return test::surface(file_with(scales), "scan.glb");
    };
    const auto refusal_of_splats = [&](const std::vector<float> &scales) {
        return test::error(file_with(scales), "scan.glb").message;
    };
    const Surface s = read_with({0.1F, 0.2F, 0.8F, 1, 1, 1, 0.1F, 0.2F, 0.8F});
    ASSERT_EQ(s.positions.size(), 2U);
    EXPECT_NEAR(s.positions[0].y, 2, 1e-6);
    EXPECT_NEAR(std::abs(s.normals[0].y), 1, 1e-6);
    EXPECT_NEAR(s.radii[0], 0.8, 1e-6); // 2 sqrt(0.2 * 0.8)
    EXPECT_EQ(s.two_sided, (std::vector<std::uint8_t>{1, 1}));
    EXPECT_EQ(s.colours[0], (Rgb8{128, 128, 128}));
    EXPECT_EQ(s.colours[1], (Rgb8{255, 0, 128}));
    EXPECT_TRUE(test::has(test::note_of(s, "opacity"), "1 of 3 splats"));
    glb.doc["accessors"][opacities]["bufferView"] = glb.view(std::vector<float>{0, 0.1F, 0});
    EXPECT_TRUE(test::has(refusal_of_splats({1, 1, 1, 1, 1, 1, 1, 1, 1}), "all splats are fainter than 0.2"));
    glb.doc["accessors"][opacities]["bufferView"] = glb.view(std::vector<float>{1, 0.1F, 1});
    const Surface logarithms = read_with({-3, -2, -1, 1, 1, 1, -3, -2, -1});
    EXPECT_NEAR(logarithms.radii[0], 2 * std::exp(-1.5), 1e-5);
}

} // namespace
