// Images of roughness and metal become materials of points.
#include "pbm_build/images/reflectance_materials.h"
#include "pbm_scan/conventions/reflectance.h"
#include "unit/build/built_models.h"
#include "unit/support/value_of.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

namespace {

using namespace pbm;
using namespace pbm::build;
using test::at_depth;
using test::built;
using test::file_of;

using RoughMetal = std::array<std::uint8_t, 2>;

// As the reader makes it of an image of a glTF file whose factors are 1.
template <class At> Texture reflectance_map(std::uint32_t size, const At &at) {
    Texture made{.width = size, .height = size, .texels = {}, .use = {.content = ImageContent::roughness_metal}};
    made.use.factors.metal = 1;
    for (std::uint32_t y = 0; y < size; ++y)
        for (std::uint32_t x = 0; x < size; ++x) {
            const RoughMetal texel = at(x, y);
            made.texels.push_back({0, texel[0], texel[1], 255});
        }
    settle_reflectance(made);
    return made;
}

// The square [0, 1]^2 in the plane z = 0, whose corners are those of the map.
Surface reflecting_square(Texture map) {
    Surface surface;
    surface.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    surface.triangles = {{0, 1, 2}, {0, 2, 3}};
    surface.materials = {Material{}};
    surface.reflectances = {Reflectance{}};
    ImageLayer &layer = surface.layer(Layer::reflectance);
    layer.corners = {{glm::vec2(0, 1), glm::vec2(1, 1), glm::vec2(1, 0)},
                     {glm::vec2(0, 1), glm::vec2(1, 0), glm::vec2(0, 0)}};
    layer.ids = {0, 0};
    surface.textures.push_back(std::move(map));
    return surface;
}

Texture map_of_halves(const RoughMetal &left, const RoughMetal &right) {
    return reflectance_map(64, [&](std::uint32_t x, auto) { return x < 32 ? left : right; });
}

Texture random_map(std::uint32_t seed) {
    std::mt19937 random(seed);
    return reflectance_map(64, [&](auto, auto) {
        return RoughMetal{static_cast<std::uint8_t>(random() % 256), static_cast<std::uint8_t>(random() % 256)};
    });
}

// The material of each of the finest points, and the x of its voxel in model space.
struct PlacedMaterial {
    double x;
    Material material;
};
std::vector<PlacedMaterial> placed_materials(const Model &model) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = value_of(expand_level(codes, model.levels[level].masks, model.levels[level].points.size()));
    std::vector<PlacedMaterial> placed;
    const Bytes &numbers = model.levels.back().points.materials;
    const Grid &grid = model.parameters.grid;
    for (std::size_t i = 0; i < codes.size(); ++i)
        placed.push_back({grid.origin[0] + (morton_decode(codes[i])[0] + 0.5) * grid.voxel_size,
                          model.parameters.materials[numbers.empty() ? 0 : numbers[i]]});
    return placed;
}

std::string said_of(const BuildStatistics &said, std::string_view name) {
    const auto line = std::find_if(said.attributes.begin(), said.attributes.end(),
                                   [&](const AttributeReport &report) { return report.name == name; });
    return line == said.attributes.end() ? "" : line->note;
}

TEST(Reflectance, EachPlaceHasTheMaterialOfItsTexels) {
    BuildStatistics said;
    const Model model = built(reflecting_square(map_of_halves({51, 255}, {102, 0})), at_depth(6), &said);
    ASSERT_EQ(model.parameters.materials.size(), 2U);
    EXPECT_EQ(said_of(said, "materials"),
              "2 materials of images of roughness and metal, 0.0 % from them (root of the mean square)");
    Material metal, dull;
    set_reflectance({.roughness = 0.2, .metal = 1}, metal);
    set_reflectance({.roughness = 0.4, .metal = 0}, dull);
    EXPECT_NEAR(metal.ks, 0.8 * 0.7, 1e-6);
    EXPECT_NEAR(dull.ks, 0.6 * 0.1, 1e-6);
    std::array<std::size_t, 2> counts{};
    for (const auto &[x, material] : placed_materials(model)) {
        const Material &expected = x < 0.5 ? metal : dull;
        ++counts[x < 0.5 ? 0 : 1];
        ASSERT_NEAR(material.ks, expected.ks, 0.003) << x;
        ASSERT_NEAR(material.power / expected.power, 1, 0.02) << x;
        ASSERT_NEAR(material.environment, expected.environment, 0.003) << x;
        ASSERT_EQ(material.kd, Material{}.kd);
    }
    EXPECT_GT(counts[0], 500U);
    EXPECT_GT(counts[1], 500U);
}

TEST(Reflectance, ManyValuesBecomeAsManyMaterialsAsTheFileHolds) {
    BuildOptions options = at_depth(6);
    BuildStatistics said;
    const Model model = built(reflecting_square(random_map(1)), options, &said);
    EXPECT_EQ(model.parameters.materials.size(), kMaxMaterials);
    const double error = std::stod(said_of(said, "materials").substr(said_of(said, "materials").find(", ") + 2));
    EXPECT_GT(error, 2);
    EXPECT_LT(error, 16); // two halves of a square have 22
    options.scene.ground.emplace();
    EXPECT_EQ(built(reflecting_square(random_map(1)), options).parameters.materials.size(),
              kMaxMaterials); // with that of the ground
}

TEST(Reflectance, OneValueIsOneMaterialWithoutAStream) {
    const Model model = built(reflecting_square(map_of_halves({51, 0}, {51, 0})), at_depth(6));
    ASSERT_EQ(model.parameters.materials.size(), 1U);
    EXPECT_NEAR(model.parameters.materials[0].ks, 0.08, 1e-3);
    EXPECT_FALSE(model.parameters.attributes.material);
}

TEST(Reflectance, NeitherThreadsNorOrderMatter) {
    const Surface surface = reflecting_square(random_map(2));
    BuildOptions options = at_depth(7);
    options.threads = 1;
    const Bytes file = file_of(built(surface, options));
    options.threads = 4;
    EXPECT_TRUE(file_of(built(surface, options)) == file);
    Surface other = surface;
    std::swap(other.triangles[0], other.triangles[1]);
    std::swap(other.layer(Layer::reflectance).corners[0], other.layer(Layer::reflectance).corners[1]);
    for (std::size_t i = 0; i < 2; ++i) { // another corner first
        other.triangles[i] = {other.triangles[i].y, other.triangles[i].z, other.triangles[i].x};
        TextureCorners &corners = other.layer(Layer::reflectance).corners[i];
        std::rotate(corners.begin(), corners.begin() + 1, corners.end());
    }
    EXPECT_TRUE(file_of(built(other, options)) == file);
}

// Texels that no triangle shows have no say.
TEST(Reflectance, OnlyWhatIsShownCounts) {
    Surface surface = reflecting_square(map_of_halves({51, 255}, {204, 0}));
    for (TextureCorners &corners : surface.layer(Layer::reflectance).corners)
        for (glm::vec2 &corner : corners)
            corner.x = 0.1F + 0.3F * corner.x;
    EXPECT_EQ(built(surface, at_depth(6)).parameters.materials.size(), 1U);
}

TEST(Reflectance, OtherMaterialsStay) {
    Surface surface = reflecting_square(map_of_halves({51, 255}, {102, 0}));
    surface.positions.insert(surface.positions.end(),
                             {{2, 0, 0}, {3, 0, 0}, {2, 1, 0}, {4, 0, 0}, {5, 0, 0}, {4, 1, 0}});
    surface.triangles.insert(surface.triangles.end(), {{4, 5, 6}, {7, 8, 9}});
    surface.layer(Layer::reflectance).ids.resize(4, Surface::kNoTexture);
    surface.layer(Layer::reflectance).corners.resize(4);
    const Material unlit{.ka = 1, .kd = 0, .ks = 0};
    Material smooth;
    set_reflectance({.roughness = 0.2, .metal = 1}, smooth);
    surface.materials = {Material{}, unlit, smooth};
    surface.reflectances = {Reflectance{}, std::nullopt, Reflectance{.roughness = 0.2, .metal = 1}};
    surface.material_ids = {0, 0, 0, 0, 1, 1, 1, 2, 2, 2};
    const Model model = built(surface, at_depth(6));
    EXPECT_EQ(model.parameters.materials.size(), 3U); // that of the third triangle is the image's left half
    const std::vector<PlacedMaterial> placed = placed_materials(model);
    const auto at = [&](double x) {
        return std::min_element(placed.begin(), placed.end(),
                                [&](const PlacedMaterial &a, const PlacedMaterial &b) {
                                    return std::abs(a.x - x) < std::abs(b.x - x);
                                })
            ->material;
    };
    EXPECT_EQ(at(2.1).ka, 1);
    EXPECT_EQ(at(2.1).kd, 0);
    EXPECT_NEAR(at(4.1).ks, smooth.ks, 0.003);
    EXPECT_NEAR(at(0.2).ks, smooth.ks, 0.003);
    EXPECT_NEAR(at(0.8).ks, 0.06, 0.003);
}

TEST(Reflectance, OptionsWin) {
    BuildOptions options = at_depth(6);
    options.scene.materials = {Material{.ks = 0.25F}};
    BuildStatistics said;
    const Model model = built(reflecting_square(random_map(3)), options, &said);
    ASSERT_EQ(model.parameters.materials.size(), 1U);
    EXPECT_EQ(model.parameters.materials[0].ks, 0.25F);
    EXPECT_EQ(said_of(said, "images of roughness and metal"), "--material");
    options.scene = {};
    options.scene.ignore_point_colours = true;
    EXPECT_EQ(built(reflecting_square(random_map(3)), options).parameters.materials.size(), 1U);
    options.scene = {};
    options.scene.environment = 0.3F;
    for (const Material &material : built(reflecting_square(random_map(3)), options).parameters.materials)
        EXPECT_EQ(material.environment, 0.3F);
}

TEST(Reflectance, SeveralInputsShareTheMaterials) {
    const Surface left = reflecting_square(map_of_halves({51, 255}, {102, 0}));
    Surface right = reflecting_square(map_of_halves({102, 0}, {204, 255}));
    for (glm::dvec3 &p : right.positions)
        p.x += 2;
    const Model model = built(std::vector<Surface>{left, right}, at_depth(6));
    EXPECT_EQ(model.parameters.materials.size(), 3U);
    EXPECT_TRUE(file_of(built(std::vector<Surface>{right, left}, at_depth(6))) == file_of(model));
}

TEST(Reflectance, GlossIsTheComplementOfRoughness) {
    EXPECT_EQ(reflectance_of(0.04, 0.25), (Reflectance{.roughness = 0.75, .metal = 0, .specular = 1}));
    EXPECT_EQ(reflectance_of(1, 1), (Reflectance{.roughness = 0, .metal = 1, .specular = 1}));
    EXPECT_EQ(reflectance_of(0.02, 1).specular, 0.5);
    Texture image{
        .width = 1, .height = 1, .texels = {{188, 0, 0, 128}}, .use = {.content = ImageContent::specular_gloss}};
    settle_reflectance(image);
    EXPECT_EQ(image.use.content, ImageContent::reflectance);
    // Half of the light, half of the gloss.
    EXPECT_NEAR(image.texels[0][0], 127, 1);
    EXPECT_NEAR(image.texels[0][1], 0.5 * (0.5 - 0.04) / 0.96 * 255, 2);
    EXPECT_NEAR(image.texels[0][2], 128, 1);
}

} // namespace
