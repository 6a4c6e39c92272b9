#include "ray_caster.h"

#include "embree_scene.h"
#include "pbm_format/parallel.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <limits>

namespace pbm {

struct RayCaster::Scene : EmbreeScene {
    using EmbreeScene::EmbreeScene;
};

RayCaster::RayCaster(const TriangleMesh &mesh, const glm::dvec3 &centre)
    : scene_(std::make_unique<Scene>(mesh.positions, mesh.triangles, centre, RTC_SCENE_FLAG_ROBUST)), centre_(centre) {}

RayCaster::~RayCaster() = default;

RayImage RayCaster::cast(const Camera &camera, int width, int height, int threads) const {
    const EyeAxes axes = eye_axes(camera);
    const double focal = height / (2 * std::tan(camera.view_angle / 2));
    const glm::vec3 eye = camera.position - centre_;
    RayImage image;
    image.depths.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    image.inside.resize(image.depths.size());
    parallel_for(static_cast<std::size_t>(height), threads, [&](std::size_t y) {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
            // Length 1 along the view direction: the ray's parameter is the depth.
            const glm::vec3 direction = axes.forward +
                                        axes.right * ((static_cast<double>(x) + 0.5 - width / 2.0) / focal) -
                                        axes.up * ((static_cast<double>(y) + 0.5 - height / 2.0) / focal);
            RTCRayHit hit{};
            hit.ray.org_x = eye.x;
            hit.ray.org_y = eye.y;
            hit.ray.org_z = eye.z;
            hit.ray.dir_x = direction.x;
            hit.ray.dir_y = direction.y;
            hit.ray.dir_z = direction.z;
            hit.ray.tfar = std::numeric_limits<float>::infinity();
            hit.ray.mask = ~0U;
            hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(scene_->scene, &context, &hit);
            const bool hits = hit.hit.geomID != RTC_INVALID_GEOMETRY_ID;
            const std::size_t at = y * static_cast<std::size_t>(width) + x;
            image.depths[at] = hits ? hit.ray.tfar : std::numeric_limits<float>::infinity();
            image.inside[at] =
                hits && hit.hit.Ng_x * direction.x + hit.hit.Ng_y * direction.y + hit.hit.Ng_z * direction.z > 0;
        }
    });
    return image;
}

} // namespace pbm
