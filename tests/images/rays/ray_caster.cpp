#include "ray_caster.h"

#include "embree_scene.h"
#include "system/threads/parallel.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <limits>

namespace pbm {
namespace {

RTCRay make_ray(const glm::vec3 &origin, const glm::vec3 &direction, float reach) {
    RTCRay ray{};
    ray.org_x = origin.x;
    ray.org_y = origin.y;
    ray.org_z = origin.z;
    ray.dir_x = direction.x;
    ray.dir_y = direction.y;
    ray.dir_z = direction.z;
    ray.tfar = reach;
    ray.mask = ~0U;
    return ray;
}

} // namespace

PixelRays::PixelRays(const Camera &camera, int width, int height) : eye(camera.position) {
    const EyeAxes axes = eye_axes(camera);
    const double focal = height / (2 * std::tan(camera.view_angle / 2));
    right_ = axes.right / focal;
    down_ = -axes.up / focal;
    corner_ = axes.forward - width / 2.0 * right_ - height / 2.0 * down_;
}

struct RayCaster::Scene : EmbreeScene {
    using EmbreeScene::EmbreeScene;
};

RayCaster::RayCaster(const TriangleMesh &mesh, const glm::dvec3 &centre)
    : scene_(std::make_unique<Scene>(mesh.positions, mesh.triangles, centre, RTC_SCENE_FLAG_ROBUST)), centre_(centre) {}

RayCaster::~RayCaster() = default;

std::optional<RayHit> RayCaster::nearest(const glm::dvec3 &origin, const glm::dvec3 &direction) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit hit{};
    hit.ray = make_ray(origin - centre_, direction, std::numeric_limits<float>::infinity());
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_->scene, &context, &hit);
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID)
        return std::nullopt;
    return RayHit{.distance = hit.ray.tfar,
                  .triangle = hit.hit.primID,
                  .weights = {1 - hit.hit.u - hit.hit.v, hit.hit.u, hit.hit.v},
                  .face = glm::normalize(glm::vec3(hit.hit.Ng_x, hit.hit.Ng_y, hit.hit.Ng_z))};
}

bool RayCaster::is_blocked(const glm::dvec3 &origin, const glm::dvec3 &direction, double reach) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray = make_ray(origin - centre_, direction, static_cast<float>(reach));
    rtcOccluded1(scene_->scene, &context, &ray);
    return ray.tfar < 0;
}

RayImage RayCaster::cast(const Camera &camera, int width, int height, int threads) const {
    const PixelRays rays(camera, width, height);
    RayImage image;
    image.depths.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    image.inside.resize(image.depths.size());
    image.cosines.resize(image.depths.size());
    parallel_for(static_cast<std::size_t>(height), threads, [&](std::size_t y) {
        for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
            const glm::dvec3 direction = rays.through(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
            const std::optional<RayHit> hit = nearest(rays.eye, direction);
            const std::size_t at = y * static_cast<std::size_t>(width) + x;
            image.depths[at] = hit ? hit->distance : std::numeric_limits<float>::infinity();
            const double along = hit ? glm::dot(glm::dvec3(hit->face), glm::normalize(direction)) : 0;
            image.inside[at] = along > 0;
            image.cosines[at] = static_cast<float>(std::abs(along));
        }
    });
    return image;
}

} // namespace pbm
