#include "pbm_render/camera/camera.h"

#include <glm/geometric.hpp>

#include <cmath>

namespace pbm {
namespace {

bool is_finite(const glm::dvec3 &v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

bool is_usable(const ClipRegion &clip) {
    return (!clip.plane ||
            (is_finite(clip.plane->point) && is_finite(clip.plane->normal) && glm::length(clip.plane->normal) > 0)) &&
           (!clip.box || (is_finite(clip.box->least) && is_finite(clip.box->most)));
}

} // namespace

bool is_usable(const Camera &camera) {
    const glm::dvec3 sight = camera.focal_point - camera.position;
    const double turn = glm::length(glm::cross(sight, camera.up));
    return std::isfinite(turn) && turn > 1e-9 * glm::length(sight) * glm::length(camera.up) &&
           camera.view_angle > 1e-6 && camera.view_angle < 3.14 && is_usable(camera.clip);
}

double view_height(const Camera &camera) {
    return 2 * glm::length(camera.focal_point - camera.position) * std::tan(camera.view_angle / 2);
}

Camera telecentric(const Camera &camera, double grid_edge) {
    if (!camera.orthographic)
        return camera;
    const double half = view_height(camera) / 2;
    const double distance = std::min(kTelecentricDistance * grid_edge, half / std::tan(kMinTelecentricAngle / 2));
    Camera drawn = camera;
    drawn.position = camera.focal_point - distance * eye_axes(camera).forward;
    drawn.view_angle = 2 * std::atan(half / distance);
    drawn.orthographic = false;
    return drawn;
}

EyeAxes eye_axes(const Camera &camera) {
    assert(is_usable(camera));
    EyeAxes axes{};
    axes.forward = glm::normalize(camera.focal_point - camera.position);
    axes.right = glm::normalize(glm::cross(axes.forward, camera.up));
    axes.up = glm::cross(axes.right, axes.forward);
    return axes;
}

glm::dvec3 up_direction(UpAxis up) {
    return up == UpAxis::y ? glm::dvec3(0, 1, 0) : up == UpAxis::z ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
}

glm::dvec3 front_direction(UpAxis up) { return up == UpAxis::z ? glm::dvec3(0, -1, 0) : glm::dvec3(0, 0, 1); }

EyeAxes front_axes(UpAxis up) {
    const glm::dvec3 y = up_direction(up), z = front_direction(up);
    return {.right = glm::cross(y, z), .up = y, .forward = -z};
}

} // namespace pbm
