// Normal maps become the normals of points.
#include "pbm_build/images/relief.h"
#include "pbm_build/surface/corner_tangents.h"
#include "pbm_build/winding/turn_faces.h"
#include "pbm_format/model/normal.h"
#include "unit/build/built_models.h"
#include "unit/build/small_meshes.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <random>

namespace {

using namespace pbm;
using namespace pbm::build;
using test::at_depth;
using test::built;
using test::file_of;

using Texel = std::array<std::uint8_t, 4>;
const Texel kFlat{128, 128, 255, 255};

Texel texel_of(const glm::dvec3 &normal) {
    const auto byte = [](double part) { return static_cast<std::uint8_t>((part + 1) * 127.5 + 0.5); };
    const glm::dvec3 n = glm::normalize(normal);
    return {byte(n.x), byte(n.y), byte(n.z), 255};
}

template <class Normal> Texture normal_map(std::uint32_t size, const Normal &normal) {
    Texture made{.width = size, .height = size, .texels = {}, .use = {.content = ImageContent::normals}};
    for (std::uint32_t y = 0; y < size; ++y)
        for (std::uint32_t x = 0; x < size; ++x)
            made.texels.push_back(normal(x, y));
    return made;
}

// The square [0, 1]^2 in the plane z = 0, seen from above, whose corners are those of the map.
Surface mapped_square(Texture map) {
    Surface surface;
    surface.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    surface.triangles = {{0, 1, 2}, {0, 2, 3}};
    surface.normals.assign(4, glm::vec3(0, 0, 1));
    ImageLayer &layer = surface.layer(Layer::normals);
    layer.corners = {{glm::vec2(0, 1), glm::vec2(1, 1), glm::vec2(1, 0)},
                     {glm::vec2(0, 1), glm::vec2(1, 0), glm::vec2(0, 0)}};
    layer.ids = {0, 0};
    surface.textures.push_back(std::move(map));
    return surface;
}

// The mean normal of the finest points, and how far one is from it at most.
struct Normals {
    glm::dvec3 mean{0};
    double farthest = 0;
};
Normals normals_of(const Model &model) {
    Normals normals;
    const auto normal = [&](std::uint16_t index) {
        const UnitVector &n = normal_table()[index & ~kTwoSidedBit];
        return glm::dvec3(n[0], n[1], n[2]);
    };
    const std::vector<std::uint16_t> &points = model.levels.back().points.normals;
    for (const std::uint16_t index : points)
        normals.mean += normal(index) / static_cast<double>(points.size());
    for (const std::uint16_t index : points)
        normals.farthest = std::max(normals.farthest, glm::distance(normal(index), normals.mean));
    return normals;
}

void expect_normals(const Surface &surface, const glm::dvec3 &expected, const BuildOptions &options = at_depth(6)) {
    const Normals found = normals_of(built(surface, options));
    constexpr double kStep = 0.05; // of the 8,192 normals of the format
    EXPECT_LT(glm::distance(found.mean, glm::normalize(expected)), kStep)
        << found.mean.x << " " << found.mean.y << " " << found.mean.z;
    EXPECT_LT(found.farthest, 0.02);
}

TEST(NormalMaps, RedIsAlongTheTangentAndGreenUpwardsInTheImage) {
    const glm::dvec3 leaning(0.3, 0.5, 0.8);
    const Texture map = normal_map(8, [&](auto, auto) { return texel_of(leaning); });
    expect_normals(mapped_square(normal_map(8, [](auto, auto) { return kFlat; })), {0, 0, 1});
    expect_normals(mapped_square(map), leaning);
    Surface scaled = mapped_square(map);
    scaled.textures[0].use.relief = 0.5F;
    expect_normals(scaled, {0.15, 0.25, 0.8});
    Surface turned = mapped_square(map); // the image by a quarter
    for (TextureCorners &corners : turned.layer(Layer::normals).corners)
        for (glm::vec2 &corner : corners)
            corner = {1 - corner.y, corner.x};
    expect_normals(turned, {-0.5, 0.3, 0.8});
    Surface mirrored = mapped_square(map);
    for (TextureCorners &corners : mirrored.layer(Layer::normals).corners)
        for (glm::vec2 &corner : corners)
            corner.x = 1 - corner.x;
    expect_normals(mirrored, {-0.3, 0.5, 0.8});
}

TEST(NormalMaps, GivenTangentsWin) {
    Surface surface = mapped_square(normal_map(8, [&](auto, auto) { return texel_of({0.3, 0.5, 0.8}); }));
    surface.tangents.assign(4, glm::vec4(0, 1, 0, 1));
    expect_normals(surface, {-0.5, 0.3, 0.8});
    surface.tangents.assign(4, glm::vec4(0, 1, 0, -1));
    expect_normals(surface, {0.5, 0.3, 0.8});
    surface.tangents.assign(4, glm::vec4(0)); // none: computed
    expect_normals(surface, {0.3, 0.5, 0.8});
}

// Normals that are turned with their faces leave the two other directions of the map where they are.
TEST(NormalMaps, FacesThatAreTurnedKeepTheirRelief) {
    Surface surface = mapped_square(normal_map(8, [&](auto, auto) { return texel_of({0.3, 0.5, 0.8}); }));
    for (const bool has_tangents : {false, true}) {
        Surface turned = surface;
        turned.tangents.assign(has_tangents ? 4 : 0, glm::vec4(1, 0, 0, 1));
        EXPECT_EQ(turn_faces(turned, std::vector<std::uint8_t>(2, 1)).normals, 4U);
        expect_normals(turned, {0.3, 0.5, -0.8});
    }
}

TEST(NormalMaps, NormalsAreMeansOverTheVoxel) {
    const auto map = normal_map(512, [](std::uint32_t x, std::uint32_t y) {
        return texel_of({(x + y) % 2 == 0 ? 0.8 : -0.8, 0, 0.6});
    });
    expect_normals(mapped_square(map), {0, 0, 1});
}

TEST(NormalMaps, ChangeNothingButNormals) {
    std::mt19937 random(5);
    Surface surface = mapped_square(normal_map(64, [&](auto, auto) {
        return texel_of({static_cast<double>(random() % 100) - 50, static_cast<double>(random() % 100) - 50, 60});
    }));
    const Model rough = built(surface, at_depth(7));
    surface.layer(Layer::normals) = {};
    surface.textures.clear();
    const Model plain = built(surface, at_depth(7));
    const auto &a = rough.levels.back(), &b = plain.levels.back();
    EXPECT_EQ(a.masks, b.masks);
    EXPECT_EQ(a.points.radii, b.points.radii);
    EXPECT_EQ(a.points.colours, b.points.colours);
    EXPECT_NE(a.points.normals, b.points.normals);
}

TEST(NormalMaps, TheFileDoesNotDependOnThreadsOrOnTheOrderOfTriangles) {
    std::mt19937 random(3);
    Surface surface = mapped_square(normal_map(64, [&](auto, auto) {
        return texel_of({static_cast<double>(random() % 100) - 50, static_cast<double>(random() % 100) - 50, 60});
    }));
    surface.positions[2].z = 0.3; // bent, with computed normals
    surface.normals.clear();
    surface.layer(Layer::normals).corners[1][2] = {0.1, 0.2};
    BuildOptions options = at_depth(8);
    options.threads = 1;
    const Bytes one = file_of(built(surface, options));
    options.threads = 5;
    EXPECT_EQ(one, file_of(built(surface, options)));
    for (unsigned seed = 0; seed < 4; ++seed)
        EXPECT_EQ(one, file_of(built(test::shuffled(surface, seed), options))) << seed;
}

TEST(NormalMaps, SurfacesThatAreMergedKeepTheirs) {
    Surface left = mapped_square(normal_map(4, [](auto, auto) { return texel_of({0.6, 0, 0.8}); }));
    Surface right = mapped_square(normal_map(4, [](auto, auto) { return texel_of({-0.6, 0, 0.8}); })), plain = right;
    plain.layer(Layer::normals) = {};
    plain.textures.clear();
    for (glm::dvec3 &p : right.positions)
        p.x += 2;
    for (glm::dvec3 &p : plain.positions)
        p.x += 4;
    const Model model = built({left, plain, right}, at_depth(7));
    std::array<std::size_t, 3> counts{}; // that lean left, not, and right
    for (const std::uint16_t index : model.levels.back().points.normals) {
        const auto x = static_cast<double>(normal_table()[index & ~kTwoSidedBit][0]);
        ++counts[x < -0.5 ? 0 : x > 0.5 ? 2 : 1];
    }
    for (const std::size_t count : counts)
        EXPECT_NEAR(static_cast<double>(count), static_cast<double>(counts[0]), 100);
}

// A fan of four faces around a vertex, each with another gradient of the texture coordinates; MikkTSpace's mean of
// them.
TEST(NormalMaps, TangentsAreMeansWeightedByAngles) {
    Surface surface;
    surface.positions = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {-1, 0, 0}};
    surface.triangles = {{0, 1, 2}, {0, 2, 3}};
    surface.normals.assign(4, glm::vec3(0, 0, 1));
    ImageLayer &layer = surface.layer(Layer::normals);
    // The first face has its tangent along x, the second one along y: 1/4 of a turn away, both with a right angle.
    layer.corners = {{glm::vec2(0, 0), glm::vec2(1, 0), glm::vec2(0, -1)},
                     {glm::vec2(0, 0), glm::vec2(1, 0), glm::vec2(0, -1)}};
    layer.ids = {0, 0};
    surface.textures.push_back(normal_map(1, [](auto, auto) { return kFlat; }));
    const std::vector<ShortNormal> normals(4, ShortNormal{0, 0, 32767});
    const auto tangents = corner_tangents(surface, normals, false, 1);
    ASSERT_EQ(tangents.size(), 2U);
    const ShortNormal diagonal = to_short_normal({1, 1, 0}), along_x{32767, 0, 0};
    EXPECT_EQ(tangents[0].along[0], diagonal);
    EXPECT_EQ(tangents[1].along[0], diagonal);
    EXPECT_EQ(tangents[0].along[1], along_x); // nobody shares this corner
    EXPECT_EQ(tangents[0].along[2], along_x); // the other face has other coordinates here
    EXPECT_FALSE(tangents[0].is_mirrored);
    surface.positions[3] = {-1, 1, 0}; // half of the angle, half of the weight
    const auto uneven = corner_tangents(surface, normals, false, 1);
    EXPECT_EQ(uneven[0].along[0], to_short_normal({2, 1, 0}));
    surface.layer(Layer::normals).corners[1] = {}; // without area it has no say
    EXPECT_EQ(corner_tangents(surface, normals, false, 1)[0].along[0], along_x);
    EXPECT_EQ(corner_tangents(surface, normals, false, 1)[1].along[1], ShortNormal{});
}

TEST(NormalMaps, ReliefIsTheChangeWithinSquares) {
    const auto relief_of = [](const Texture &map) { return measure_relief(mapped_square(map), 2).front(); };
    const Relief flat = relief_of(normal_map(16, [](auto, auto) { return kFlat; }));
    EXPECT_LT(squared_change(flat, 4), 1e-4);
    // The normal turns by 0.02 from texel to texel.
    const Relief even = relief_of(normal_map(64, [](std::uint32_t x, auto) {
        const double angle = 0.02 * (x - 32.0);
        return texel_of({std::sin(angle), 0, std::cos(angle)});
    }));
    for (const double edge : {4.0, 8.0, 16.0}) // along x alone: half of the square
        EXPECT_NEAR(std::sqrt(squared_change(even, edge)), 0.02 * edge / std::sqrt(2), 0.15 * 0.02 * edge) << edge;
    EXPECT_NEAR(std::sqrt(squared_change(even, 0.5)), std::sqrt(squared_change(even, 1)) / 2, 1e-9);
}

TEST(NormalMaps, RoughOnesMakeTheGridFiner) {
    const auto depth_with = [&](double angle) { // from texel to texel
        Surface surface = mapped_square(normal_map(1024, [&](std::uint32_t x, std::uint32_t) {
            return texel_of({std::sin(angle * (x % 16 < 8 ? x % 16 : 16 - x % 16)), 0, 1});
        }));
        for (int i = 0; i < 3; ++i) // the bytes of so many triangles keep the grid as coarse as the edges are
            for (std::size_t k = 0; k < 2; ++k) {
                surface.triangles.push_back(surface.triangles[k]);
                ImageLayer &layer = surface.layer(Layer::normals);
                layer.corners.push_back(layer.corners[k]);
                layer.ids.push_back(layer.ids[k]);
            }
        surface.face_colours.assign(surface.triangles.size(), {.colour = {9, 9, 9}, .is_given = true});
        const std::vector<ShortNormal> normals(4, ShortNormal{0, 0, 32767});
        const Result<ChosenGrid> chosen = choose_grid(surface, bounds_of(surface), normals, {}, 2);
        EXPECT_TRUE(chosen.ok());
        EXPECT_EQ(chosen->reason.find("normal maps change") != std::string::npos, chosen->grid.depth > 8) << angle;
        return chosen->grid.depth;
    };
    EXPECT_EQ(depth_with(0), 8);
    EXPECT_EQ(depth_with(0.01), 8);
    EXPECT_EQ(depth_with(0.04), 9);
    EXPECT_EQ(depth_with(0.14), 10); // not more than two
}

TEST(NormalMaps, AnIdleOptionIsSaid) {
    Surface plain = mapped_square({});
    plain.layer(Layer::normals) = {};
    plain.textures.clear();
    BuildOptions options = at_depth(6);
    options.flip_green = true;
    BuildStatistics said;
    built(plain, options, &said);
    EXPECT_TRUE(std::any_of(said.attributes.begin(), said.attributes.end(),
                            [](const AttributeReport &line) { return line.name == "--flip-green"; }));
}

} // namespace
