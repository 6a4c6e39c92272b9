// Baked shadows of closed meshes against shadow rays. Of the points that face the light at most 1 % differ with shadow
// maps, and at most 0.1 % with rays against the triangles.
#include "pbm_bake/shadow_baker.h"
#include "procedural_mesh.h"
#include "shadow_truth.h"
#include "voxel_model.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace pbm {
namespace {

constexpr double kCubeEdge = 1.6;
constexpr double kMaxWrong = 0.01, kMaxWrongByRays = 0.001;

struct Shape {
    const char *name;
    TriangleMesh (*make)();
};

std::array<float, 3> unit(const glm::vec3 &v) {
    const glm::vec3 n = glm::normalize(v);
    return {n.x, n.y, n.z};
}

// Position relative to the middle of the cube.
std::array<float, 3> place(const glm::vec3 &v) {
    const auto half = static_cast<float>(kCubeEdge / 2);
    return {v.x + half, v.y + half, v.z + half};
}

std::vector<Light> every_kind_of_light() {
    return {{.kind = LightKind::directional, .direction = unit({0.5, -0.7, -0.5})},
            {.kind = LightKind::directional, .direction = unit({-1, -0.2, -0.35})},
            {.kind = LightKind::point, .position = place({0.8, 0.9, 0.6})},
            {.kind = LightKind::point, .position = place({0.1, 0.7, 0.05})},
            {.kind = LightKind::spot, .position = place({-1, 0.4, 1.1}), .direction = unit({1, -0.4, -1.1})}};
}

class BakedShadows : public testing::TestWithParam<Shape> {};

TEST_P(BakedShadows, DifferFromRaysAtOnePointInAHundredAtMost) {
    const TriangleMesh mesh = GetParam().make();
    const ShadowTruth truth(mesh, glm::dvec3(0));
    const Model model = voxelise_by_brute_force(mesh, 9, kCubeEdge);
    const SampledPoints sample = sample_model(truth, model, 5, 2);
    const ShadowCasters casters(model, 2);
    const glm::dvec3 origin(model.parameters.grid.origin[0], model.parameters.grid.origin[1],
                            model.parameters.grid.origin[2]);
    const auto corner = [&](unsigned position) {
        const glm::dvec3 p = (mesh.positions[position] - origin) / model.parameters.grid.voxel_size;
        return Position{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    };
    const auto triangle = [&](std::size_t i) {
        const glm::uvec3 &corners = mesh.triangles[i];
        return TriangleTree::Triangle{corner(corners.x), corner(corners.y), corner(corners.z)};
    };
    const TriangleTree tree(mesh.triangles.size(), triangle, 2);
    const ShadowRays rays(casters, tree, 2);
    ASSERT_TRUE(rays.complete());
    for (const Light &light : every_kind_of_light()) {
        const Bytes baked = bake_light(casters, light, {.threads = 2});
        const ShadowFigures figures = compare_shadows(truth, sample, model.parameters.grid, light, baked, 2);
        EXPECT_GT(figures.facing, 5000U);
        EXPECT_LE(figures.wrong(), kMaxWrong)
            << testing::PrintToString(light.position) << testing::PrintToString(light.direction) << ": "
            << figures.false_shadow << " in shadow, " << figures.false_light << " lit of " << figures.facing;
        const Bytes by_rays = bake_light(casters, light, {.rays = &rays, .threads = 2});
        EXPECT_LE(compare_shadows(truth, sample, model.parameters.grid, light, by_rays, 2).wrong(), kMaxWrongByRays)
            << testing::PrintToString(light.position) << testing::PrintToString(light.direction);
    }
}

INSTANTIATE_TEST_SUITE_P(Meshes, BakedShadows,
                         testing::Values(Shape{"Torus", make_torus}, Shape{"Cube", make_cube}, Shape{"Bowl", make_bowl},
                                         Shape{"Knot", make_knot}),
                         [](const auto &shape) { return std::string(shape.param.name); });

} // namespace
} // namespace pbm
