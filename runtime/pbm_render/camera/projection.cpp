#include "pbm_render/camera/projection.h"

#include <glm/geometric.hpp>

#include <cmath>

namespace pbm {

Projection::Projection(const Camera &camera, int width, int height)
    : eye(camera.position), axes(eye_axes(camera)), focal(height / (2 * std::tan(camera.view_angle / 2))),
      middle(width / 2.0, height / 2.0), clip(camera.clip), shows_backs(camera.backs != Backs::hide),
      has_round_points(camera.has_round_points) {}

glm::dvec3 Projection::vector(glm::dvec3 model) const {
    const double depth = glm::dot(axes.forward, model);
    return {focal * glm::dot(axes.right, model) + middle.x * depth,
            -focal * glm::dot(axes.up, model) + middle.y * depth, depth};
}

// Subtract the eye first, in doubles: georeferenced models lie millions of units from their origin.
glm::dvec3 Projection::point(glm::dvec3 model) const { return vector(model - eye); }

glm::dvec3 Projection::plane(glm::dvec3 normal) const {
    const double x = glm::dot(axes.right, normal) / focal;
    const double y = -glm::dot(axes.up, normal) / focal;
    return {x, y, glm::dot(axes.forward, normal) - x * middle.x - y * middle.y};
}

glm::dvec3 Projection::ray(glm::dvec2 pixel) const {
    const glm::dvec2 offset = (pixel - middle) / focal;
    return axes.forward + axes.right * offset.x - axes.up * offset.y;
}

} // namespace pbm
