// The ray tracer that provides the true pictures, against values computed by hand.
#include "close_ups.h"
#include "fidelity.h"
#include "pbm_render/appearance/shade_table.h"
#include "procedural_mesh.h"
#include "ray_tracer.h"
#include "shadow_truth.h"
#include "voxel_model.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

// A square in the plane z = 0, two units wide, seen from +z, with an optional screen in front of it.
struct Floor {
    Floor() {
        mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    }

    // A screen, a quarter as wide, at height 1 above the middle, facing the floor.
    void hang_screen() {
        for (const glm::dvec3 &p : {glm::dvec3(-0.25, -0.25, 1), {0.25, -0.25, 1}, {0.25, 0.25, 1}, {-0.25, 0.25, 1}})
            mesh.positions.push_back(p);
        mesh.triangles.insert(mesh.triangles.end(), {{4, 6, 5}, {4, 7, 6}});
    }

    // Light from a place on the floor towards an eye that looks along `direction`.
    glm::dvec3 light_from(const glm::dvec3 &place, const glm::dvec3 &direction = {0, 0, -1}) {
        const RayCaster rays(mesh, glm::dvec3(0));
        SurfaceLook look = look_of(mesh);
        look.colours = colours;
        look.materials = materials_of_vertices;
        const TracedScene scene{.rays = rays,
                                .mesh = mesh,
                                .look = look,
                                .materials = materials,
                                .lights = lights,
                                .light_origin = light_origin,
                                .shadowed = shadowed};
        const glm::dvec3 eye = place - 0.5 * glm::normalize(direction);
        const auto hit = rays.nearest(eye, direction);
        return hit ? reflected_light(scene, eye, direction, *hit) : glm::dvec3(-1);
    }

    TriangleMesh mesh;
    std::vector<glm::vec3> colours = std::vector<glm::vec3>(8, glm::vec3(1));
    std::vector<std::uint8_t> materials_of_vertices;
    std::vector<Material> materials{Material{.ka = 0.125F, .kd = 0.5F, .ks = 0.25F, .power = 8}};
    std::vector<Light> lights;
    glm::dvec3 light_origin{0};
    int shadowed = 0;
};

Light from_above(float x, float z) { return Light{.direction = {x, 0, z}}; }

TEST(RayTracer, AddsAmbientDiffuseAndSpecularLight) {
    Floor floor;
    EXPECT_NEAR(floor.light_from({0.3, 0.2, 0}).g, 0.125, 1e-6);
    floor.lights = {from_above(0, -1)};
    EXPECT_NEAR(floor.light_from({0.3, 0.2, 0}).g, 0.125 + 0.5 + 0.25, 1e-6);
    floor.lights = {from_above(0.6F, -0.8F)}; // cosine of mirrored ray and eye: 0.8
    EXPECT_NEAR(floor.light_from({0.3, 0.2, 0}).g, 0.125 + 0.5 * 0.8 + 0.25 * std::pow(0.8, 8), 1e-6);
    floor.lights = {from_above(0.6F, 0.8F)}; // from below
    EXPECT_NEAR(floor.light_from({0.3, 0.2, 0}).g, 0.125, 1e-6);
}

TEST(RayTracer, SeesSpecularLightFromTheEyesOwnPlace) {
    Floor floor;
    floor.lights = {from_above(0.6F, -0.8F)};
    EXPECT_NEAR(floor.light_from({0.3, 0.2, 0}, {-0.6, 0, -0.8}).g, 0.125 + 0.5 * 0.8 + 0.25, 1e-6);
}

TEST(RayTracer, CountsPlacesOfLightsFromTheGridsCorner) {
    Floor floor;
    floor.light_origin = {-3, 0, 0};
    floor.lights = {Light{.kind = LightKind::point, .intensity = {1, 0.5F, 0}, .position = {3, 0, 2}}};
    const glm::dvec3 light = floor.light_from({1e-4, 1e-4, 0});
    EXPECT_NEAR(light.r, 0.125 + 0.5 + 0.25, 1e-5);
    EXPECT_NEAR(light.g, 0.125 + 0.5 * (0.5 + 0.25), 1e-5);
    EXPECT_NEAR(light.b, 0.125, 1e-5);
    EXPECT_NEAR(floor.light_from({0.9, 0, 0}).b, 0.125, 1e-6);
}

TEST(RayTracer, DimsSpotLightsByTheAngle) {
    Floor floor;
    floor.lights = {Light{.kind = LightKind::spot, .position = {0, 0, 1}, .direction = {0, 0, -1}, .exponent = 3}};
    const double cosine = 1 / std::sqrt(1 + 0.25);
    EXPECT_NEAR(floor.light_from({0.5, 0, 0}).g,
                0.125 + std::pow(cosine, 3) * (0.5 * cosine + 0.25 * std::pow(cosine, 8)), 1e-5);
}

TEST(RayTracer, CastsShadowsOfTheFirstLightsOnly) {
    Floor floor;
    floor.hang_screen();
    floor.lights = {from_above(0, -1)};
    const glm::dvec3 under{0.1, 0.05, 0}, beside{0.4, 0.05, 0};
    EXPECT_NEAR(floor.light_from(under).g, 0.875, 1e-6);
    floor.shadowed = 1;
    EXPECT_NEAR(floor.light_from(under).g, 0.125, 1e-6);
    EXPECT_NEAR(floor.light_from(beside).g, 0.875, 1e-6);
    floor.lights = {Light{.kind = LightKind::point, .position = {0, 0, 0.9F}}}; // below the screen
    EXPECT_NEAR(floor.light_from({1e-4, 1e-4, 0}).g, 0.875, 1e-5);
}

TEST(RayTracer, MixesColoursInLinearLightAndTakesTheMaterialOfTheNearestCorner) {
    Floor floor;
    floor.materials = {Material{.ka = 1, .kd = 0, .ks = 0}, Material{.ka = 0.5F, .kd = 0, .ks = 0}};
    floor.colours[0] = floor.colours[3] = glm::vec3(0); // left corners black, right corners white
    floor.materials_of_vertices = {0, 1, 1, 0};
    EXPECT_NEAR(floor.light_from({-0.5, 0, 0}).r, 0.25, 1e-5);
    EXPECT_NEAR(floor.light_from({0.5, 0, 0}).r, 0.5 * 0.75, 1e-5);
}

TEST(RayTracer, ShadesACubeFlatAndASphereSmoothly) {
    const TriangleMesh cube = make_cube(), sphere = make_sphere();
    for (const std::array<glm::vec3, 3> &corners : look_of(cube).normals)
        EXPECT_TRUE(corners[0] == corners[1] && corners[1] == corners[2]);
    const SurfaceLook look = look_of(sphere);
    float least = 1;
    for (std::size_t i = 0; i < sphere.triangles.size(); ++i)
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const glm::dvec3 &place = sphere.positions[sphere.triangles[i][static_cast<int>(corner)]];
            least = std::min(least, glm::dot(look.normals[i][corner], glm::vec3(glm::normalize(place))));
        }
    EXPECT_GT(least, 0.999F);
}

// Rounding errors at the surface must not cast shadows, and a convex shape casts none on itself. At grazing incidence
// the planes of triangles face away before the normals of points do.
TEST(ShadowTruth, ComparesFlagsWithRays) {
    const TriangleMesh mesh = make_sphere();
    const ShadowTruth truth(mesh, glm::dvec3(0));
    Model model = voxelise_by_brute_force(mesh, 6, 1.6);
    model.parameters.lights = {from_above(0.6F, -0.8F)};
    model.parameters.attributes.lights = 1;
    model.parameters.attributes.shadow_bits[0].fill(1);
    Bytes &flags = model.levels.back().points.shadows[0];
    flags.assign(model.point_count(), 1);
    const ShadowFigures lit = check_shadows(truth, model, 2).at(0);
    EXPECT_NEAR(static_cast<double>(lit.facing), static_cast<double>(model.point_count()) / 2,
                0.02 * static_cast<double>(model.point_count()));
    EXPECT_GT(static_cast<double>(lit.lit), 0.99 * static_cast<double>(lit.facing));
    EXPECT_EQ(lit.false_light, lit.facing - lit.lit);
    EXPECT_EQ(lit.false_shadow, 0U);
    flags.assign(model.point_count(), 0);
    const ShadowFigures dark = check_shadows(truth, model, 2).at(0);
    EXPECT_EQ(dark.false_shadow, lit.lit);
    EXPECT_EQ(dark.false_light, 0U);
}

TEST(CloseUps, LookAtTheSurfaceFrontOnAndAt45Degrees) {
    const RayCaster rays(make_sphere(), glm::dvec3(0));
    const auto views = eight_views({glm::dvec3(0), 0.8}, UpAxis::y, 320, 180);
    const auto found = close_ups(rays, views, 0.001, 320, 180);
    ASSERT_EQ(found.size(), 16U);
    for (const CloseUp &it : found) {
        const PixelRays pixels(it.camera, 320, 180);
        const auto hit = rays.nearest(pixels.eye, pixels.through(160, 90));
        ASSERT_TRUE(hit);
        const double focal = 90 / std::tan(it.camera.view_angle / 2);
        EXPECT_NEAR(focal * 0.001 / static_cast<double>(hit->distance), it.pixels_per_voxel, 0.05);
        const double cosine = -glm::dot(glm::dvec3(hit->face), glm::normalize(pixels.through(160, 90)));
        EXPECT_NEAR(cosine, it.slanted ? std::sqrt(0.5) : 1, 0.05);
    }
}

} // namespace
} // namespace pbm
