// Images of roughness and metal become materials of points.
#include "pbm_build/images/reflectance_materials.h"
#include "pbm_build/surface/material_colours.h"
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

Texture plain_image(ImageContent content, const std::array<std::uint8_t, 4> &left,
                    const std::array<std::uint8_t, 4> &right) {
    Texture made{.width = 64, .height = 64, .texels = {}, .use = {.content = content}};
    for (std::uint32_t i = 0; i < 64 * 64; ++i)
        made.texels.push_back(i % 64 < 32 ? left : right);
    return made;
}

// Adds an image of a layer, which lies on the same places as that of reflectance, or turned by half of a turn.
void add_layer(Surface &surface, Layer layer, Texture image, bool is_turned = false) {
    surface.layer(layer) = surface.layer(Layer::reflectance);
    for (std::uint16_t &id : surface.layer(layer).ids)
        id = static_cast<std::uint16_t>(surface.textures.size());
    for (TextureCorners &corners : surface.layer(layer).corners)
        for (glm::vec2 &corner : corners)
            corner = is_turned ? 1.0F - corner : corner;
    surface.textures.push_back(std::move(image));
}

// A square of this colour whose left half emits red light.
Surface glowing_square(const Rgb8 &colour, std::uint8_t red) {
    Surface surface = reflecting_square(map_of_halves({102, 0}, {102, 0}));
    surface.colours.assign(4, colour);
    add_layer(surface, Layer::emission, plain_image(ImageContent::emission, {red, 0, 0, 255}, {0, 0, 0, 255}));
    return surface;
}

Material usual() { return {.ka = 0.25F, .kd = 0.5F}; }

TEST(Reflectance, EmissionIsAddedToTheColourAndStaysWithoutLight) {
    BuildOptions options = at_depth(6);
    options.scene.default_material = usual();
    BuildStatistics said;
    // Linear: 0.2159 and 0.5028 of red, 0.2159 of green and blue.
    const Model model = built(glowing_square({128, 128, 128}, 188), options, &said);
    ASSERT_EQ(model.parameters.materials.size(), 2U);
    EXPECT_NE(said_of(said, "materials").find("of images of roughness, metal and emission, 0."), std::string::npos);
    const double sum = 0.2126 * 0.7187 + (0.7152 + 0.0722) * 0.2159, share = 0.2126 * 0.5028 / sum;
    const std::vector<PlacedMaterial> placed = placed_materials(model);
    for (std::size_t i = 0; i < placed.size(); ++i) {
        const auto &[x, material] = placed[i];
        const Rgb8 colour = point_colour(model.levels.back().points.colours, i, ColourFormat::rgb888);
        if (std::abs(x - 0.5) < 0.05)
            continue;
        const bool glows = x < 0.5;
        ASSERT_NEAR(colour[0], glows ? linear_to_srgb(47099) : 128, 1) << x;
        ASSERT_NEAR(colour[1], 128, 1);
        ASSERT_NEAR(material.ka, glows ? share + (1 - share) * 0.25 : 0.25, 0.004) << x;
        ASSERT_NEAR(material.kd, glows ? (1 - share) * 0.5 : 0.5, 0.004) << x;
        ASSERT_NEAR(material.ks, 0.06, 0.003);
    }
}

// What is emitted is there in the dark, to the last step: ka times the colour.
TEST(Reflectance, EmissionOverWhiteIsNoDarker) {
    BuildOptions options = at_depth(6);
    options.scene.default_material = Material{.ka = 0, .kd = 1};
    Surface surface = glowing_square({255, 255, 255}, 255);
    surface.textures.back() = plain_image(ImageContent::emission, {255, 255, 255, 255}, {188, 188, 188, 255});
    for (const auto &[x, material] : placed_materials(built(surface, options)))
        if (std::abs(x - 0.5) > 0.05) {
            ASSERT_NEAR(material.ka, x < 0.5 ? 1 : 0.5028, 0.004);
        }
}

TEST(Reflectance, OneEmissionEverywhereIsInTheColours) {
    Surface surface = glowing_square({0, 0, 0}, 188);
    surface.textures.back() = plain_image(ImageContent::emission, {188, 0, 0, 255}, {188, 0, 0, 255});
    const Model model = built(surface, at_depth(6));
    ASSERT_EQ(model.parameters.materials.size(), 1U);
    EXPECT_EQ(model.parameters.materials[0].ka, 1);
    EXPECT_EQ(model.parameters.materials[0].kd, 0);
    EXPECT_FALSE(model.parameters.attributes.material);
    EXPECT_EQ(point_colour(model.levels.back().points.colours, 7, ColourFormat::rgb888), (Rgb8{188, 0, 0}));
}

TEST(Reflectance, OcclusionDarkensAmbientLightAlone) {
    BuildOptions options = at_depth(6);
    options.scene.default_material = usual();
    Surface surface = reflecting_square(map_of_halves({102, 0}, {102, 0}));
    add_layer(surface, Layer::occlusion, plain_image(ImageContent::darkness, {204, 0, 0, 255}, {0, 0, 0, 255}), true);
    BuildStatistics said;
    const Model model = built(surface, options, &said);
    ASSERT_EQ(model.parameters.materials.size(), 2U);
    EXPECT_NE(said_of(said, "materials").find("of images of roughness, metal and occlusion, 0."), std::string::npos);
    for (const auto &[x, material] : placed_materials(model))
        if (std::abs(x - 0.5) > 0.05) {
            ASSERT_NEAR(material.ka, x > 0.5 ? 0.05 : 0.25, 0.002) << x; // the image is turned
            ASSERT_EQ(material.kd, 0.5F);
        }
}

// Materials are replaced, but not what colours points.
TEST(Reflectance, ColoursOfMaterialsStay) {
    Surface surface = reflecting_square(map_of_halves({102, 0}, {102, 0}));
    surface.materials = {Material{.colour = {255, 0, 0}}, Material{.colour = {0, 0, 255}}};
    surface.reflectances = {Reflectance{}, Reflectance{}};
    surface.material_ids = {1, 1, 1, 1};
    Surface lone = surface;
    colour_by_materials(surface);
    EXPECT_EQ(surface.colours, std::vector<Rgb8>(4, Rgb8{0, 0, 255}));
    lone.materials[1].colour = {255, 0, 0};
    colour_by_materials(lone);
    EXPECT_TRUE(lone.colours.empty());
    add_layer(lone, Layer::emission, plain_image(ImageContent::emission, {9, 9, 9, 255}, {9, 9, 9, 255}));
    colour_by_materials(lone); // to which emission is added
    EXPECT_EQ(lone.colours, std::vector<Rgb8>(4, Rgb8{255, 0, 0}));
}

// Images that do not lie on each other: each combination has its material.
TEST(Reflectance, LayersMeetOnTheSurface) {
    Surface surface = reflecting_square(map_of_halves({51, 255}, {102, 0}));
    surface.colours.assign(4, {0, 0, 0});
    add_layer(surface, Layer::emission, plain_image(ImageContent::emission, {255, 0, 0, 255}, {0, 0, 0, 255}));
    for (TextureCorners &corners : surface.layer(Layer::emission).corners)
        for (glm::vec2 &corner : corners) // left and right become up and down
            std::swap(corner.x, corner.y);
    BuildOptions options = at_depth(6);
    const Model model = built(surface, options);
    EXPECT_EQ(model.parameters.materials.size(), 4U);
    options.threads = 1;
    EXPECT_TRUE(file_of(built(surface, options)) == file_of(model));
    Surface other = surface;
    for (std::size_t i = 0; i < 2; ++i) { // another corner first
        other.triangles[i] = {other.triangles[i].y, other.triangles[i].z, other.triangles[i].x};
        for (ImageLayer &layer : other.layers)
            if (!layer.corners.empty())
                std::rotate(layer.corners[i].begin(), layer.corners[i].begin() + 1, layer.corners[i].end());
    }
    EXPECT_TRUE(file_of(built(other, options)) == file_of(model));
}

TEST(Reflectance, MetalsAreTinted) {
    Surface surface = reflecting_square(map_of_halves({51, 255}, {102, 0}));
    for (const Material &material : built(surface, at_depth(6)).parameters.materials)
        EXPECT_EQ(material.tint, material.environment > 0 ? 255 : 0);
    Surface of_factors = surface;
    surface.textures[0].use.factors.tints = false;
    of_factors.reflectances[0]->tints = false;
    for (const Surface &other : {surface, of_factors})
        for (const Material &material : built(other, at_depth(6)).parameters.materials)
            EXPECT_EQ(material.tint, 0);
}

// Surfaces as a reader makes them of damaged files: any texels, any places, triangles without an image, no colours.
TEST(Reflectance, NoSurfaceIsTooStrange) {
    for (std::uint32_t seed = 0; seed < 12; ++seed) {
        std::mt19937 random(seed);
        const auto below = [&](std::uint32_t end) { return static_cast<std::uint32_t>(random() % end); };
        Surface surface = reflecting_square(random_map(seed));
        const std::size_t extra = below(30);
        for (std::size_t i = 0; i < extra; ++i) {
            const std::uint32_t first = static_cast<std::uint32_t>(surface.positions.size());
            for (int k = 0; k < 3; ++k)
                surface.positions.push_back(glm::dvec3(below(3), below(3), below(3)) * (below(2) != 0 ? 1e-9 : 1.0));
            surface.triangles.push_back({first, first + 1, first + 2});
        }
        const std::size_t count = surface.triangles.size();
        if (seed % 2 != 0)
            for (std::size_t i = 0; i < surface.positions.size(); ++i)
                surface.colours.push_back({static_cast<std::uint8_t>(below(256)), 0, 255});
        const auto content = [&](Layer layer) {
            return layer == Layer::emission    ? ImageContent::emission
                   : layer == Layer::occlusion ? ImageContent::darkness
                                               : ImageContent::reflectance;
        };
        for (const Layer layer : {Layer::reflectance, Layer::emission, Layer::occlusion}) {
            if (below(3) == 0 && layer != Layer::reflectance)
                continue;
            Texture image{
                .width = 1 + below(5), .height = 1 + below(5), .texels = {}, .use = {.content = content(layer)}};
            for (std::uint32_t i = 0; i < image.width * image.height; ++i)
                image.texels.push_back({static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()),
                                        static_cast<std::uint8_t>(random()), 255});
            image.use.wrap = {static_cast<Wrap>(below(3)), static_cast<Wrap>(below(3))};
            surface.textures.push_back(std::move(image));
            ImageLayer &to = surface.layer(layer);
            to.ids.assign(count, Surface::kNoTexture);
            to.corners.assign(count, {});
            for (std::size_t i = 0; i < count; ++i) {
                if (below(4) != 0)
                    to.ids[i] = static_cast<std::uint16_t>(surface.textures.size() - 1);
                for (glm::vec2 &corner : to.corners[i])
                    corner = glm::vec2(static_cast<float>(below(7)) - 3, below(9) == 0 ? 999999.0F : 0.3F);
            }
        }
        surface.reflectances = {below(2) != 0 ? std::optional(Reflectance{.metal = 1}) : std::nullopt};
        BuildOptions options = at_depth(4);
        const Model model = built(surface, options);
        EXPECT_LE(model.parameters.materials.size(), kMaxMaterials);
        const Bytes file = file_of(model); // refuses numbers of materials that do not exist
        options.threads = 1;
        EXPECT_TRUE(file_of(built(surface, options)) == file) << seed;
    }
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
