#include "shadow_truth.h"

#include "embree_scene.h"

#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <limits>

namespace pbm {
namespace {

constexpr float kLift = 0.01F; // voxels

struct NearestQuery {
    const std::vector<glm::dvec3> &positions;
    std::span<const glm::uvec3> triangles;
    glm::dvec3 from;
    double distance = std::numeric_limits<double>::infinity();
    glm::dvec3 nearest{};
    unsigned triangle = 0;
};

// Based on: Ericson. Real-Time Collision Detection. 2005, section 5.1.5
glm::dvec3 nearest_on_triangle(const glm::dvec3 &p, const glm::dvec3 &a, const glm::dvec3 &b, const glm::dvec3 &c) {
    const glm::dvec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
                 d6 = dot(ac, cp);
    if (d1 <= 0 && d2 <= 0)
        return a;
    if (d3 >= 0 && d4 <= d3)
        return b;
    if (d6 >= 0 && d5 <= d6)
        return c;
    const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0)
        return a + ab * (d1 / (d1 - d3));
    if (vb <= 0 && d2 >= 0 && d6 <= 0)
        return a + ac * (d2 / (d2 - d6));
    if (va <= 0 && d4 >= d3 && d5 >= d6)
        return b + (c - b) * ((d4 - d3) / (d4 - d3 + (d5 - d6)));
    return a + ab * (vb / (va + vb + vc)) + ac * (vc / (va + vb + vc));
}

bool look_at_triangle(RTCPointQueryFunctionArguments *arguments) {
    NearestQuery &query = *static_cast<NearestQuery *>(arguments->userPtr);
    const glm::uvec3 &corners = query.triangles[arguments->primID];
    const glm::dvec3 nearest = nearest_on_triangle(query.from, query.positions[corners.x], query.positions[corners.y],
                                                   query.positions[corners.z]);
    const double distance = glm::length(nearest - query.from);
    if (!(distance < query.distance))
        return false;
    query.distance = distance;
    query.nearest = nearest;
    query.triangle = arguments->primID;
    arguments->query->radius = static_cast<float>(distance * 1.0001);
    return true;
}

} // namespace

TowardsLight towards_light(const Light &light, const Grid &grid, const glm::dvec3 &place) {
    if (light.kind == LightKind::directional)
        return {-glm::vec3(light.direction[0], light.direction[1], light.direction[2]),
                std::numeric_limits<float>::infinity()};
    const glm::dvec3 way = glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]) +
                           glm::dvec3(light.position[0], light.position[1], light.position[2]) - place;
    const double distance = glm::length(way);
    return {way / distance, static_cast<float>(distance)};
}

struct ShadowTruth::Scene {
    Scene(std::span<const glm::dvec3> all, std::span<const glm::uvec3> corners, const glm::dvec3 &origin)
        : centre(origin), positions(all.begin(), all.end()), triangles(corners.begin(), corners.end()),
          rays(positions, triangles, centre, RTC_SCENE_FLAG_ROBUST) {}
    glm::dvec3 centre;
    std::vector<glm::dvec3> positions;
    std::vector<glm::uvec3> triangles;
    EmbreeScene rays;
};

ShadowTruth::ShadowTruth(std::span<const glm::dvec3> positions, std::span<const glm::uvec3> triangles, const Grid &grid)
    : scene_(std::make_unique<Scene>(positions, triangles,
                                     glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]) + grid.edge() / 2)),
      grid_(grid) {}

ShadowTruth::~ShadowTruth() = default;

SurfacePlace ShadowTruth::nearest(const glm::dvec3 &centre, const glm::vec3 &normal) const {
    NearestQuery query{scene_->positions, scene_->triangles, centre};
    const glm::dvec3 local = centre - scene_->centre;
    RTCPointQuery ball{};
    ball.x = static_cast<float>(local.x);
    ball.y = static_cast<float>(local.y);
    ball.z = static_cast<float>(local.z);
    ball.radius = std::numeric_limits<float>::infinity();
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_->rays.scene, &ball, &context, look_at_triangle, &query);
    const glm::uvec3 &corners = scene_->triangles[query.triangle];
    const auto &p = scene_->positions;
    glm::vec3 facet = glm::normalize(glm::cross(p[corners.y] - p[corners.x], p[corners.z] - p[corners.x]));
    if (!(glm::dot(facet, facet) > 0)) // no area
        facet = normal;
    return {query.nearest, glm::dot(facet, normal) < 0 ? -facet : facet, static_cast<float>(query.distance)};
}

bool ShadowTruth::reached(const SurfacePlace &place, const TowardsLight &light, float skip) const {
    const float side = glm::dot(place.normal, light.direction) < 0 ? -1.0F : 1.0F;
    const glm::dvec3 lift = place.normal * (side * kLift);
    return reached(place.position + lift * grid_.voxel_size + glm::dvec3(light.direction * skip),
                   {light.direction, light.distance - skip});
}

bool ShadowTruth::reached(const glm::dvec3 &from, const TowardsLight &light) const {
    if (light.distance <= 0)
        return true;
    const glm::vec3 origin = from - scene_->centre;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray{};
    ray.org_x = origin.x;
    ray.org_y = origin.y;
    ray.org_z = origin.z;
    ray.dir_x = light.direction.x;
    ray.dir_y = light.direction.y;
    ray.dir_z = light.direction.z;
    ray.tfar = light.distance;
    ray.mask = ~0U;
    rtcOccluded1(scene_->rays.scene, &context, &ray);
    return ray.tfar >= 0;
}

} // namespace pbm
