// Scenes of glTF: nodes, cameras, skins and morph targets.
#include "unit/scan/gltf_files.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;

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

TEST(Gltf, QuaternionsAreNormalised) {
    Glb glb;
    glb.show({{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}}, {"indices", glb.indices({0, 1, 2})}}},
             {{"rotation", {0, 0, 0.5, 0.5}}});
    const Surface s = surface(glb);
    EXPECT_NEAR(s.positions[1].y, 1, 1e-12);
    EXPECT_TRUE(says(s, "rotations", Fate::converted));
}

// The limit counts them before memory is taken for them.
TEST(Gltf, NodesAreAtMostAMillion) {
    Glb glb;
    glb.show({{{"attributes", {{"POSITION", glb.floats(kSquare, "VEC3", 3)}}}}});
    for (int i = 0; i < 1100; ++i) {
        glb.doc["nodes"].push_back(json::object());
        glb.doc["nodes"][1]["children"].push_back(2);
        glb.doc["nodes"][2]["children"].push_back(3);
    }
    glb.doc["scenes"][0]["nodes"].push_back(1);
    EXPECT_TRUE(test::has(refusal(glb), "more than 1048576 nodes"));
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

} // namespace
