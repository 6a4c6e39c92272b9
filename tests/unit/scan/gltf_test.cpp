// glTF and GLB: what is read, and that damage is refused.
#include "pbm_scan/gltf/gltf_reader.h"

#include "pbm_format/model/point_values.h"
#include "unit/scan/gltf_files.h"

#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

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

// Their vertices are those of the surface, too.
TEST(Gltf, NormalsAreAsManyAsVerticesWithoutFacesToo) {
    const auto with_normals = [](Glb &glb, std::size_t count) {
        const auto normals = glb.floats(std::vector<float>(3 * count, 1), "VEC3", 3);
        const auto vertices = [&] { return json{{"POSITION", glb.floats(kSquare, "VEC3", 3)}}; };
        const json faces{{"attributes", vertices()}, {"indices", glb.indices({0, 1, 2})}};
        json none{{"attributes", vertices()}, {"indices", glb.indices({})}};
        none["attributes"]["NORMAL"] = normals;
        glb.show({faces, none});
    };
    Glb whole, fewer;
    with_normals(whole, 4);
    EXPECT_EQ(surface(whole).triangles.size(), 1U);
    with_normals(fewer, 3);
    EXPECT_TRUE(test::has(refusal(fewer), "NORMAL are not as many as POSITION"));
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

TEST(Gltf, SparseIndicesAreRead) {
    Glb glb;
    const json sparse{{"count", 2},
                      {"indices", {{"bufferView", glb.view(std::vector<std::uint8_t>{1, 2})}, {"componentType", 5121}}},
                      {"values", {{"bufferView", glb.view(std::vector<std::uint16_t>{2, 3})}}}};
    const auto indices = glb.accessor({{"componentType", 5123}, {"count", 3}, {"type", "SCALAR"}, {"sparse", sparse}});
    glb.show({{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}}, {"indices", indices}}});
    EXPECT_EQ(surface(glb).triangles, (std::vector<glm::uvec3>{{0, 2, 3}}));
}

TEST(Gltf, MaterialsThatDoNotExistAreNamed) {
    for (const json &material : {json(7), json(-1)}) {
        Glb glb;
        const auto positions = glb.floats(kSquare, "VEC3", 3), indices = glb.indices({0, 1, 2});
        const json plain{{"attributes", {{"POSITION", positions}}}, {"indices", indices}};
        json primitive = plain;
        primitive["material"] = material;
        glb.show({plain, primitive});
        EXPECT_TRUE(says(surface(glb), "materials that do not exist", Fate::dropped)) << material;
    }
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
    // A view does not become good when it is asked for again.
    glb.doc["images"] = {{{"bufferView", 0}, {"mimeType", "image/png"}}};
    glb.doc["textures"] = {{{"source", 0}}};
    glb.doc["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    glb.doc["meshes"][0]["primitives"][0]["material"] = 0;
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
        const Result<Surface> s = read(file, "scan.glb");
        ASSERT_TRUE(s) << s.error().message;
        EXPECT_EQ(says(*s, "chunks", Fate::converted), length % 4 != 0);
    }
    EXPECT_EQ(test::note_of(*read(glb.file() + "garbage", "scan.glb"), "end of file"), "7 bytes behind the GLB file");
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
        EXPECT_FALSE(read(file.substr(0, size), "scan.glb").ok()) << size;
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
    glb.doc["accessors"][rotations]["count"] = 0;
    EXPECT_TRUE(test::has(refusal_of_splats({1, 1, 1, 1, 1, 1, 1, 1, 1}), "ROTATION are not as many as POSITION"));
}

} // namespace
