// Lights, materials and surroundings: parsing of options, placement, and the resulting model.
#include "pbm_build/scene/material_request.h"
#include "pbm_build/scene/scene.h"
#include "pbm_format/checking/validate.h"
#include "pbm_format/reading/reader.h"
#include "unit/build/built_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace {

using namespace pbm;
using namespace pbm::build;
using test::built;
using test::file_of;
using test::refused;

// A floor of 2 x 2 at y = -1 and a small plate above it, both facing up, with colours.
Surface plates() {
    Surface surface;
    for (unsigned i = 0; i < 8; ++i) {
        const double half = i < 4 ? 1 : 0.3;
        surface.positions.emplace_back((i & 1) != 0 ? half : -half, i < 4 ? -1 : -0.4, (i & 2) != 0 ? half : -half);
    }
    surface.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 6, 7}, {4, 7, 5}};
    surface.colours.assign(8, {200, 100, 50});
    return surface;
}

BuildOptions at_depth(int depth, SceneRequest scene = {}, int threads = 2) {
    BuildOptions options;
    options.grid.depth = depth;
    options.threads = threads;
    options.scene = std::move(scene);
    return options;
}

SceneRequest everything() {
    SceneRequest scene;
    scene.lights = light_set("studio");
    scene.shadows.emplace();
    scene.texture.emplace();
    scene.texture->kind = TextureKind::wood;
    scene.ground.emplace();
    scene.ground->texture = TextureKind::marble;
    scene.ground->texels = 64;
    return scene;
}

std::string why(const Result<LightRequest> &light) { return light.ok() ? "" : light.error().message; }

TEST(LightRequest, ParsesEveryField) {
    const auto light =
        read_light("spot, from=-1,2,1.5, intensity=0.5, colour=#ff0000, exponent=3, size=0.1, shadows=off");
    ASSERT_TRUE(light.ok()) << why(light);
    EXPECT_EQ(light->kind, LightKind::spot);
    EXPECT_EQ(light->from, (Vector{-1, 2, 1.5}));
    EXPECT_EQ(light->intensity, (Vector{0.5, 0, 0}));
    EXPECT_EQ(light->exponent, 3);
    EXPECT_EQ(light->size, 0.1);
    EXPECT_EQ(light->shadows, false);
    EXPECT_EQ(read_light("directional,direction=0.6,-0.6,-0.5,intensity=1,2,3")->intensity, (Vector{1, 2, 3}));
}

TEST(LightRequest, RefusesImpossibleValues) {
    for (const char *text : {"",
                             "sun",
                             "spot",
                             "directional",
                             "directional,direction=0,0,0",
                             "directional,direction=nan,0,1",
                             "directional,direction=1,2",
                             "directional,direction=1,2,3,4",
                             "directional,direction=1e999,0,0",
                             "directional,direction=1e31,0,0",
                             "directional,from=0,0,0",
                             "directional,position=1,2,3",
                             "point,from=1,2,3,direction=0,0,1",
                             "point,position=1,2,inf",
                             "point,position=1,2,3,from=1,2,3",
                             "point,from=1,1,1,intensity=-1",
                             "point,from=1,1,1,intensity=1e7",
                             "point,from=1,1,1,intensity=nan",
                             "spot,from=1,1,1,exponent=2000",
                             "spot,position=1,1,1,target=1,1,1",
                             "spot,from=0,0,0",
                             "spot,from=1,1,1,direction=0,0,1,target=0,0,0",
                             "spot,from=1,1,1,from=2,2,2",
                             "point,from=1,1,1,shadows=yes",
                             "point,from=1,1,1,size=-1",
                             "point,from=1,1,1,colour=red",
                             "point,from=1,1,1,,",
                             "point,from=1,1,1,x=2"}) {
        const auto light = read_light(text);
        ASSERT_FALSE(light.ok()) << text;
        EXPECT_EQ(light.error().code, ErrorCode::usage) << text;
    }
}

TEST(LightRequest, EverySetFitsEveryUpAxis) {
    for (const std::string_view name : light_set_names())
        for (const UpAxis up : {UpAxis::x, UpAxis::y, UpAxis::z}) {
            const std::array<MortonCode, 2> corners{0, 511};
            const ModelFrame frame = frame_of({.depth = 3, .origin = {5, 6, 7}, .voxel_size = 0.5, .up = up}, corners);
            EXPECT_DOUBLE_EQ(frame.radius, 2 * std::sqrt(3.0));
            for (const LightRequest &request : light_set(name)) {
                const Light light = place(request, frame);
                const auto &d = light.direction;
                EXPECT_NEAR(d[0] * d[0] + d[1] * d[1] + d[2] * d[2], 1, 1e-5);
                EXPECT_LT(d[static_cast<std::size_t>(frame.up_axis)], 0.0F) << "it shines down";
                EXPECT_TRUE(lights_nothing(light, frame).empty());
            }
        }
}

TEST(LightRequest, PlacesInTheModelAreCountedFromTheGridsCorner) {
    const std::array<MortonCode, 2> corners{0, 511};
    const ModelFrame frame = frame_of({.depth = 3, .origin = {10, 20, 30}, .voxel_size = 1}, corners);
    const Light point = place(value_of(read_light("point,position=11,22,33")), frame);
    EXPECT_EQ(point.position, (std::array<float, 3>{1, 2, 3}));
    const Light spot = place(value_of(read_light("spot,position=14,24,40,target=14,24,34")), frame);
    EXPECT_EQ(spot.direction, (std::array<float, 3>{0, 0, -1}));
    EXPECT_TRUE(lights_nothing(spot, frame).empty());
    const Light away = place(value_of(read_light("spot,position=14,24,50,direction=0,0,1")), frame);
    EXPECT_FALSE(lights_nothing(away, frame).empty());
}

TEST(MaterialRequest, NamesAndNumbers) {
    for (const std::string_view name : material_names())
        EXPECT_TRUE(read_material(name).ok()) << name;
    EXPECT_EQ(read_material("gold,tint=0.5")->tint, 128);
    EXPECT_EQ(read_material("gold")->tint, 0);
    const auto gold = read_material("gold,environment=0.5,colour=1,2,3");
    ASSERT_TRUE(gold.ok());
    EXPECT_EQ(gold->environment, 0.5F);
    EXPECT_EQ(gold->colour, (Rgb8{1, 2, 3}));
    EXPECT_EQ(read_material("ka=1")->ka, 1.0F);
    EXPECT_EQ(read_material("legacy")->kd, 0.0F);
    for (const char *text : {"", "wool", "ka=2", "kd=-1", "ks=nan", "power=0", "power=2000", "environment=1.1",
                             "tint=1.1", "colour=#12345", "colour=1,2,300", "gold,shine=1"})
        EXPECT_FALSE(read_material(text).ok()) << text;
}

TEST(Scene, EverythingMakesAValidFileWhateverTheThreads) {
    const Model model = built(plates(), at_depth(6, everything()));
    const AttributeSet &set = model.parameters.attributes;
    ASSERT_EQ(model.parameters.lights.size(), 3U);
    EXPECT_EQ(set.lights, 2) << "the fill light of the studio casts none, and stands last";
    EXPECT_EQ(set.shadow_bits[0][6], 4) << "soft";
    EXPECT_EQ(set.shadow_bits[1][6], 1);
    EXPECT_TRUE(set.texture);
    EXPECT_FALSE(set.material);
    EXPECT_EQ(model.parameters.materials.size(), 2U);
    EXPECT_EQ(model.images.ground_lit.size(), 2U);
    EXPECT_EQ(model.images.ground_texture.width, 64U);
    const Bytes file = file_of(model);
    const ValidationReport verdict = validate(file);
    EXPECT_TRUE(verdict.valid());
    EXPECT_EQ(file_of(built(plates(), at_depth(6, everything(), 7))), file);
    const auto &lit = model.levels.back().points.shadows[1];
    EXPECT_GT(std::count(lit.begin(), lit.end(), 0), 100) << "the plate shades the floor";
    EXPECT_GT(std::count(lit.begin(), lit.end(), 1), 1000);
    const Bytes &ground = model.images.ground_lit[0].texels;
    EXPECT_GT(std::count(ground.begin(), ground.end(), 0), 10);
    EXPECT_GT(std::count(ground.begin(), ground.end(), 255), 1000);
}

TEST(Scene, DefaultsAddNoScene) {
    const Model model = built(plates(), at_depth(6));
    EXPECT_TRUE(model.parameters.lights.empty());
    EXPECT_FALSE(model.parameters.ground);
    EXPECT_EQ(model.parameters.materials, std::vector<Material>(1));
    EXPECT_EQ(model.images, ModelImages{});
}

TEST(Scene, ShadowsAndGroundBringTheLightsOfViewers) {
    SceneRequest scene;
    scene.shadows.emplace();
    const Model model = built(plates(), at_depth(6, scene));
    ASSERT_EQ(model.parameters.lights.size(), 2U);
    EXPECT_EQ(model.parameters.attributes.lights, 2);
    EXPECT_EQ(model.parameters.lights[0].intensity[0], 1.1F);
}

TEST(Scene, TheGroundTouchesTheLowestPoint) {
    SceneRequest scene;
    scene.ground.emplace();
    BuildOptions options = at_depth(6, scene);
    const Model y_up = built(plates(), options);
    EXPECT_NEAR(y_up.parameters.grid.origin[1] + y_up.parameters.ground->centre[1], -1, 0.02) << "within a voxel";
    EXPECT_NEAR(y_up.parameters.ground->half_edge, 3.5 * std::sqrt(2.09), 0.2);
    options.grid.up = UpAxis::z;
    options.scene.ground->height = -3;
    const Model z_up = built(plates(), options);
    EXPECT_NEAR(z_up.parameters.grid.origin[2] + z_up.parameters.ground->centre[2], -3, 1e-5);
    EXPECT_NEAR(z_up.parameters.grid.origin[0] + z_up.parameters.ground->centre[0], 0, 1e-5);
}

// Each shadow map casts four rays per ground texel, so there are at most 4 * maps + 1 values.
std::size_t values_on_the_ground(double light_size, std::optional<int> maps) {
    SceneRequest scene;
    scene.lights.push_back(value_of(read_light("directional,direction=0,-1,0,size=" + std::to_string(light_size))));
    scene.shadows = {.bits = {}, .maps = maps};
    scene.ground.emplace();
    scene.ground->texels = 512;
    scene.ground->height = -3;
    const Model model = built(plates(), at_depth(5, scene));
    const Bytes &texels = model.images.ground_lit.at(0).texels;
    return std::set<std::uint8_t>(texels.begin(), texels.end()).size();
}

TEST(Scene, TheWiderAPenumbraOnTheGroundTheMoreMaps) {
    EXPECT_LE(values_on_the_ground(0, {}), 4 * 16 + 1U);
    EXPECT_LE(values_on_the_ground(0.02, {}), 4 * 24 + 1U) << "as wide as three texels";
    EXPECT_GT(values_on_the_ground(0.6, {}), 4 * 40U) << "steps of its 24 maps would be bands";
    EXPECT_LE(values_on_the_ground(0.6, 24), 4 * 24 + 1U) << "as asked for";
}

TEST(Scene, MaterialsReplaceThoseOfTheScan) {
    Surface two = plates();
    two.materials.resize(2);
    two.materials[1].ka = 0.5F;
    two.material_ids = {0, 0, 0, 0, 1, 1, 1, 1};
    SceneRequest scene;
    scene.materials = {value_of(read_material("gold"))};
    const Model one = built(two, at_depth(6, scene));
    EXPECT_EQ(one.parameters.materials.size(), 1U);
    EXPECT_FALSE(one.parameters.attributes.material);
    EXPECT_EQ(one.parameters.materials[0].environment, 0.3F);
    EXPECT_NE(one.parameters.attributes.colour, ColourFormat::none) << "colours stay";

    scene.materials = {value_of(read_material("gold")), value_of(read_material("clay")),
                       value_of(read_material("mirror"))};
    BuildStatistics said;
    const Model both = built(two, at_depth(6, scene), &said);
    EXPECT_EQ(both.parameters.materials.size(), 2U);
    EXPECT_TRUE(both.parameters.attributes.material);
    EXPECT_TRUE(std::any_of(said.attributes.begin(), said.attributes.end(), [](const AttributeReport &line) {
        return line.name == "materials" && line.fate == AttributeReport::Fate::dropped;
    }));
}

TEST(Scene, PointColoursAndMaterialsCanBeIgnored) {
    Surface coloured = plates();
    coloured.materials.resize(9);
    SceneRequest scene;
    scene.ignore_point_colours = true;
    const Model grey = built(coloured, at_depth(6, scene));
    EXPECT_EQ(grey.parameters.attributes.colour, ColourFormat::none);
    EXPECT_EQ(grey.parameters.materials, std::vector<Material>(1));
    scene.default_material = value_of(read_material("legacy"));
    const Model legacy = built(coloured, at_depth(6, scene));
    EXPECT_EQ(legacy.parameters.materials[0].ka, 1.0F);
    EXPECT_EQ(legacy.parameters.materials[0].kd, 0.0F);
}

TEST(Scene, ReflectionsAreThoseOfTheMaterialsOrHalf) {
    SceneRequest scene;
    scene.reflects = true;
    EXPECT_EQ(built(plates(), at_depth(6, scene)).parameters.materials[0].environment, 0.5F);
    Surface shiny = plates();
    shiny.materials.resize(1);
    shiny.materials[0].environment = 0.2F;
    EXPECT_EQ(built(shiny, at_depth(6, scene)).parameters.materials[0].environment, 0.2F);
    scene.environment = 1.0F;
    EXPECT_EQ(built(shiny, at_depth(6, scene)).parameters.materials[0].environment, 1.0F);
}

TEST(Scene, TheGroundsMaterialIsOneOfEight) {
    Surface many = plates();
    for (int i = 0; i < 8; ++i) {
        many.materials.emplace_back();
        many.materials.back().ka = 0.1F * static_cast<float>(i);
    }
    many.material_ids = {0, 1, 2, 3, 4, 5, 6, 7};
    SceneRequest scene;
    EXPECT_EQ(built(many, at_depth(6, scene)).parameters.materials.size(), 8U);
    scene.ground.emplace();
    EXPECT_EQ(refused(many, at_depth(6, scene)).code, ErrorCode::unsupported_feature);
    scene.ground->material = many.materials[3];
    EXPECT_EQ(built(many, at_depth(6, scene)).parameters.materials.size(), 8U);
}

} // namespace
