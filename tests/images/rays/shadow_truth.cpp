#include "shadow_truth.h"

#include "embree_scene.h"
#include "system/threads/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pbm {
namespace {

constexpr double kStrictLift = 0.01; // voxels
constexpr std::size_t kPointsAtOnce = 1024;

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

struct ShadowTruth::Scene {
    Scene(const TriangleMesh &all, const glm::dvec3 &origin)
        : centre(origin), mesh(all), rays(mesh.positions, mesh.triangles, centre, RTC_SCENE_FLAG_ROBUST) {}
    glm::dvec3 centre;
    TriangleMesh mesh;
    EmbreeScene rays;
};

ShadowTruth::ShadowTruth(const TriangleMesh &mesh, const glm::dvec3 &centre)
    : scene_(std::make_unique<Scene>(mesh, centre)) {}

ShadowTruth::~ShadowTruth() = default;

SurfacePlace ShadowTruth::nearest(const glm::dvec3 &from) const {
    const auto &p = scene_->mesh.positions;
    NearestQuery query{p, scene_->mesh.triangles, from};
    const glm::dvec3 local = from - scene_->centre;
    RTCPointQuery ball{};
    ball.x = static_cast<float>(local.x);
    ball.y = static_cast<float>(local.y);
    ball.z = static_cast<float>(local.z);
    ball.radius = std::numeric_limits<float>::infinity();
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_->rays.scene, &ball, &context, look_at_triangle, &query);
    const glm::uvec3 &corners = query.triangles[query.triangle];
    const glm::dvec3 across = glm::cross(p[corners.y] - p[corners.x], p[corners.z] - p[corners.x]);
    const double length = glm::length(across);
    const glm::dvec3 normal = length > 0 ? across / length : glm::dvec3(0);
    return {query.nearest, normal, normal};
}

void ShadowTruth::climb_layers(SurfacePlace &place, double reach) const {
    const double step = reach / 1000;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    const glm::dvec3 first = place.position;
    for (double height = 0; height < reach;) {
        const glm::vec3 origin = first + place.normal * (height + step) - scene_->centre;
        RTCRayHit ray{};
        ray.ray.org_x = origin.x;
        ray.ray.org_y = origin.y;
        ray.ray.org_z = origin.z;
        ray.ray.dir_x = static_cast<float>(place.normal.x);
        ray.ray.dir_y = static_cast<float>(place.normal.y);
        ray.ray.dir_z = static_cast<float>(place.normal.z);
        ray.ray.tfar = static_cast<float>(reach - height);
        ray.ray.mask = ~0U;
        ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene_->rays.scene, &context, &ray);
        if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID)
            return;
        const glm::dvec3 facet = glm::normalize(glm::dvec3(ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z));
        if (glm::dot(facet, place.normal) * glm::dot(place.facet, place.normal) <= 0)
            return;
        height += step + static_cast<double>(ray.ray.tfar);
        place.position = first + place.normal * height;
        place.facet = facet;
    }
}

bool ShadowTruth::reaches(const glm::dvec3 &from, const glm::dvec3 &direction, double distance) const {
    const glm::vec3 origin = from - scene_->centre;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray{};
    ray.org_x = origin.x;
    ray.org_y = origin.y;
    ray.org_z = origin.z;
    ray.dir_x = static_cast<float>(direction.x);
    ray.dir_y = static_cast<float>(direction.y);
    ray.dir_z = static_cast<float>(direction.z);
    ray.tfar = static_cast<float>(distance);
    ray.mask = ~0U;
    rtcOccluded1(scene_->rays.scene, &context, &ray);
    return ray.tfar >= 0;
}

TowardsLight towards_light(const Light &light, const Grid &grid, const glm::dvec3 &place) {
    if (light.kind == LightKind::directional)
        return {-glm::normalize(glm::dvec3(light.direction[0], light.direction[1], light.direction[2])),
                std::numeric_limits<double>::infinity()};
    const glm::dvec3 way = glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]) +
                           glm::dvec3(light.position[0], light.position[1], light.position[2]) - place;
    const double distance = glm::length(way);
    return {way / distance, distance};
}

SampledPoints sample_model(const ShadowTruth &truth, const Model &model, std::size_t stride, int threads) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = expand_level(codes, model.levels[level].masks, model.levels[level].points.size()).value();
    SampledPoints sample;
    for (std::size_t i = 0; i < codes.size(); i += stride)
        sample.points.push_back(i);
    sample.places.resize(sample.points.size());
    const Grid &grid = model.parameters.grid;
    const auto &normals = model.levels.back().points.normals;
    parallel_for((sample.points.size() + kPointsAtOnce - 1) / kPointsAtOnce, threads, [&](std::size_t block) {
        const std::size_t end = std::min(sample.points.size(), (block + 1) * kPointsAtOnce);
        for (std::size_t k = block * kPointsAtOnce; k < end; ++k) {
            const std::size_t i = sample.points[k];
            const auto [x, y, z] = morton_decode(codes[i]);
            const UnitVector &n = normal_table()[normals[i] & kNormalIndexMask];
            SurfacePlace place = truth.nearest(glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]) +
                                               (glm::dvec3(x, y, z) + 0.5) * grid.voxel_size);
            place.normal = {n[0], n[1], n[2]};
            place.two_sided = (normals[i] & kTwoSidedBit) != 0;
            if (!place.two_sided)
                truth.climb_layers(place, kFarthestLayer * grid.voxel_size);
            if (glm::dot(place.facet, place.normal) < 0)
                place.facet = -place.facet;
            sample.places[k] = place;
        }
    });
    return sample;
}

ShadowFigures compare_shadows(const ShadowTruth &truth, const SampledPoints &sample, const Grid &grid,
                              const Light &light, ByteView baked, int threads) {
    const glm::dvec3 spot(light.direction[0], light.direction[1], light.direction[2]);
    const std::size_t blocks = (sample.points.size() + kPointsAtOnce - 1) / kPointsAtOnce;
    std::vector<ShadowFigures> figures(blocks);
    parallel_for(blocks, threads, [&](std::size_t block) {
        ShadowFigures &sum = figures[block];
        const std::size_t end = std::min(sample.points.size(), (block + 1) * kPointsAtOnce);
        for (std::size_t k = block * kPointsAtOnce; k < end; ++k) {
            const SurfacePlace &place = sample.places[k];
            const TowardsLight way = towards_light(light, grid, place.position);
            const double side = glm::dot(place.normal, way.direction) < 0 ? -1 : 1;
            if ((side < 0 && !place.two_sided) || (light.kind == LightKind::spot && glm::dot(spot, way.direction) >= 0))
                continue;
            const bool lit = baked[sample.points[k]] != 0;
            const glm::dvec3 start = place.position + place.normal * (side * kTruthLift * grid.voxel_size);
            const TowardsLight lifted = towards_light(light, grid, start);
            const bool reached = truth.reaches(start, lifted.direction, lifted.distance);
            ++sum.facing;
            sum.lit += reached ? 1 : 0;
            sum.false_shadow += reached && !lit ? 1 : 0;
            sum.false_light += !reached && lit ? 1 : 0;
            const double cosine = side * glm::dot(place.normal, way.direction);
            sum.cosines += cosine;
            sum.wrong_cosines += reached != lit ? cosine : 0;
            if (side * glm::dot(place.facet, way.direction) <= 0)
                continue;
            ++sum.facing_strictly;
            const glm::dvec3 close = place.position + place.facet * (side * kStrictLift * grid.voxel_size);
            sum.wrong_strictly += truth.reaches(close, way.direction, way.distance) != lit ? 1 : 0;
        }
    });
    ShadowFigures total;
    for (const ShadowFigures &sum : figures) {
        total.facing += sum.facing;
        total.lit += sum.lit;
        total.false_shadow += sum.false_shadow;
        total.false_light += sum.false_light;
        total.cosines += sum.cosines;
        total.wrong_cosines += sum.wrong_cosines;
        total.facing_strictly += sum.facing_strictly;
        total.wrong_strictly += sum.wrong_strictly;
    }
    return total;
}

std::vector<ShadowFigures> check_shadows(const ShadowTruth &truth, const Model &model, int threads) {
    const SampledPoints all = sample_model(truth, model, 1, threads);
    const AttributeSet &set = model.parameters.attributes;
    std::vector<ShadowFigures> figures;
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light) {
        const unsigned most =
            (1U << set.shadow_bits[light].at(static_cast<std::size_t>(model.parameters.grid.depth))) - 1;
        Bytes lit = model.levels.back().points.shadows[light];
        for (std::uint8_t &value : lit)
            value = 2U * value > most ? 1 : 0;
        figures.push_back(
            compare_shadows(truth, all, model.parameters.grid, model.parameters.lights[light], lit, threads));
    }
    return figures;
}

} // namespace pbm
