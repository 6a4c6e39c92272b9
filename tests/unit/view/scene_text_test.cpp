#include "viewer/pbm-view/light/model_notes.h"
#include "viewer/pbm-view/light/scene_text.h"

#include "pbm_format/model/material_presets.h"
#include "unit/support/value_of.h"

#include <glm/trigonometric.hpp>
#include <gtest/gtest.h>

namespace pbm {
namespace {

TEST(SceneText, GivesLightsAsOptions) {
    const Grid grid{.depth = 4, .origin = {10, 0, -0.5}};
    EXPECT_EQ(light_as_option({.direction = {0.6F, -0.8F, 0}}, grid, std::nullopt),
              "directional,direction=0.6,-0.8,0,intensity=1,1,1");
    EXPECT_EQ(light_as_option({.kind = LightKind::point, .intensity = {0.1F, 2, 0}, .position = {1, 2, 3}}, grid, true),
              "point,position=11,2,2.5,intensity=0.1,2,0,shadows=on");
    EXPECT_EQ(light_as_option({.kind = LightKind::spot, .position = {0, 0, 1}, .exponent = 40}, grid, false),
              "spot,position=10,0,0.5,direction=0,0,-1,exponent=40,intensity=1,1,1,shadows=off");
}

TEST(SceneText, GivesMaterialsAsOptions) {
    EXPECT_EQ(material_as_option({}), "default");
    EXPECT_EQ(material_as_option(material_preset("gold")->material), "gold");
    EXPECT_EQ(material_as_option({.ka = 0.25F, .power = 3, .colour = {255, 16, 0}}),
              "default,ka=0.25,kd=0.7,ks=0.1,power=3,environment=0,colour=#ff1000");
}

ModelParameters file() {
    ModelParameters parameters;
    parameters.materials = {material_preset("bronze")->material, {.kd = 0.5F}};
    parameters.lights = {{}, {.kind = LightKind::point}};
    parameters.attributes.lights = 1;
    parameters.ground.emplace().material = 1;
    return parameters;
}

TEST(SceneText, GivesTheWholeSceneForAShell) {
    const ModelParameters parameters = file();
    EXPECT_EQ(scene_as_options(Appearance(parameters), parameters),
              " --light directional,direction=0,0,-1,intensity=1,1,1,shadows=on"
              " --light point,position=0,0,0,intensity=1,1,1,shadows=off --shadows --material bronze"
              " --ground plain --ground-material 'default,ka=0.2,kd=0.5,ks=0.1,power=16,environment=0,colour=#cccccc'");
    EXPECT_EQ(material_as_option({.kd = 0.5F, .tint = 255}),
              "default,ka=0.2,kd=0.5,ks=0.1,power=16,environment=0,colour=#cccccc,tint=1");
    EXPECT_EQ(shell_quoted("it's"), "'it'\\''s'");
    EXPECT_EQ(shell_quoted(""), "''");
    EXPECT_EQ(shell_quoted("a/b-1.pbvg"), "a/b-1.pbvg");
}

// A model that is built without lights gets the same ones again, and they follow the eye.
TEST(SceneText, LeavesOutTheLightsOfAFileWithoutLights) {
    ModelParameters parameters;
    parameters.materials.resize(1);
    Appearance appearance(parameters);
    EXPECT_EQ(scene_as_options(appearance, parameters), " --material default");
    EXPECT_EQ(scene_as_recipe(appearance, parameters, "lion.pbvg").find("[[light]]"), std::string::npos);
    appearance.lights[0].intensity = {1, 0, 0};
    EXPECT_NE(scene_as_options(appearance, parameters).find("--light"), std::string::npos);
}

TEST(SceneText, GivesARecipe) {
    const ModelParameters parameters = file();
    EXPECT_EQ(scene_as_recipe(Appearance(parameters), parameters, "lion.pbvg"),
              R"(# Lights and materials of lion.pbvg, as pbm-view showed them.
# pbm-build --recipe THIS_FILE SCAN -o MODEL.pbvg
up = "y"
shadows = true
ground = "plain"
ground-material = "default,ka=0.2,kd=0.5,ks=0.1,power=16,environment=0,colour=#cccccc"

[[light]]
kind = "directional"
direction = [0,0,-1]
intensity = [1,1,1]
shadows = true

[[light]]
kind = "point"
position = [0,0,0]
intensity = [1,1,1]
shadows = false

[[material]]
name = "bronze"
)");
}

TEST(ModelNotes, NameMaterialsAndLights) {
    const ModelNotes notes = read_notes(
        R"({"name":"Lion","credit":"A. Scan","licence":"CC0-1.0","options":{"material":["gold,ks=0.5","clay"]}})");
    EXPECT_EQ(notes.name, "Lion");
    EXPECT_EQ(notes.credit, "A. Scan");
    EXPECT_EQ(notes.licence, "CC0-1.0");
    EXPECT_EQ(light_name({.kind = LightKind::spot}, 1), "Light 2 (spot)");
    EXPECT_EQ(material_name(material_preset("clay")->material, 0, notes), "Material 1 (clay)");
    EXPECT_EQ(material_name({.ka = 0.3F}, 0, notes), "Material 1 (gold, changed)");
    EXPECT_EQ(material_name({.ka = 0.3F}, 5, notes), "Material 6");
    EXPECT_EQ(read_notes(R"({"options":{"material":"silver"}})").materials, std::vector<std::string>{"silver"});
}

TEST(ModelNotes, KeepAView) {
    const SavedView view{{.position = {1, 2, 3.25}, .focal_point = {0, 0.1, 0}, .up = {0, 0, 1}}, 29.3};
    const std::string metadata = R"({"generator":"x","options":{"depth":9}})";
    const std::string with = value_of(with_start_view(metadata, view));
    EXPECT_TRUE(with.starts_with(R"({"generator":"x","options":{"depth":9},"view":{)")) << with;
    const auto read = read_notes(with).view;
    ASSERT_TRUE(read);
    EXPECT_EQ(read->camera.position, view.camera.position);
    EXPECT_EQ(read->camera.focal_point, view.camera.focal_point);
    EXPECT_EQ(read->camera.up, view.camera.up);
    EXPECT_EQ(read->view_angle, 29.3);
    EXPECT_EQ(read->camera.view_angle, glm::radians(29.3));
    EXPECT_EQ(value_of(with_start_view(with, view)), with); // replaced, not added
    SavedView flat = view;
    flat.camera.orthographic = true;
    EXPECT_TRUE(read_notes(value_of(with_start_view(with, flat))).view->camera.orthographic);
    EXPECT_FALSE(read->camera.orthographic);
    EXPECT_FALSE(with_start_view("{\"name\":\"" + std::string(4000, 'a') + "\"}", view));
}

TEST(ModelViews, AreFoundByName) {
    const std::string eye = R"("position":[1,2,3],"focal_point":[0,0,0],"up":[0,1,0],"angle":)";
    const std::string metadata = R"({"views":[{"name":"a",)" + eye + R"(40},{"name":"flat",)" + eye +
                                 R"(20,"projection":"orthographic"},{"name":"a",)" + eye + R"(10},{)" + eye +
                                 R"(40},{"name":"blind","position":[0,0,0],"focal_point":[0,0,0],"up":[0,1,0],)" +
                                 R"("angle":40},7]})";
    const auto views = named_views(metadata);
    ASSERT_EQ(views.size(), 3U);
    EXPECT_EQ(views[1].name, "flat");
    const SavedView found = value_of(find_view(metadata, "a"));
    EXPECT_EQ(found.view_angle, 40); // the first one
    ViewOptions options;
    options.clip.plane.emplace();
    options = with_camera(options, value_of(find_view(metadata, "flat")));
    EXPECT_EQ(options.position, glm::dvec3(1, 2, 3));
    EXPECT_EQ(options.focal_point, glm::dvec3(0, 0, 0));
    EXPECT_EQ(options.view_up, glm::dvec3(0, 1, 0));
    EXPECT_EQ(options.view_angle, 20);
    EXPECT_TRUE(options.orthographic && options.clip.plane);
    EXPECT_NE(find_view(metadata, "blind").error().message.find("there are: a, flat, a"), std::string::npos);
    for (const char *const without : {"", "{", "[]", "{\"views\":{}}", "{\"views\":[]}"})
        EXPECT_NE(find_view(without, "a").error().message.find("no view with a name"), std::string::npos) << without;
}

TEST(ModelNotes, IgnoreWhatTheyDoNotUnderstand) {
    for (const char *const metadata :
         {"", "{", "[]", "{\"name\":1}", "{\"options\":3}", "{\"options\":{\"material\":{}}}", "{\"view\":{}}",
          R"({"view":{"position":[0,0,0],"focal_point":[0,0,0],"up":[0,1,0],"angle":30}})",
          R"({"view":{"position":[0,0],"focal_point":[0,0,"a"],"up":[0,1,0],"angle":30}})"}) {
        const ModelNotes notes = read_notes(metadata);
        EXPECT_TRUE(notes.name.empty() && !notes.view) << metadata;
    }
}

} // namespace
} // namespace pbm
