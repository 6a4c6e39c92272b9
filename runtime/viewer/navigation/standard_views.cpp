#include "viewer/navigation/standard_views.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {

Camera fitted(const Camera &camera, const Sphere &bounds, glm::ivec2 size) {
    const double vertical = std::tan(camera.view_angle / 2);
    const double narrower = std::atan(std::min(vertical, vertical * size.x / size.y));
    Camera result = camera;
    result.focal_point = bounds.centre;
    // A sphere's outline is wider in perspective than its radius.
    const double distance = bounds.radius / (camera.orthographic ? std::tan(narrower) : std::sin(narrower));
    result.position = bounds.centre - eye_axes(camera).forward * distance;
    return result;
}

Camera standard_view(StandardView view, UpAxis up_axis, const Camera &camera, const Sphere &bounds, glm::ivec2 size) {
    const glm::dvec3 up = up_direction(up_axis), front = front_direction(up_axis), right = glm::cross(up, front);
    glm::dvec3 from = front;
    switch (view) {
    case StandardView::front: break;
    case StandardView::side: from = right; break;
    case StandardView::top: from = up; break;
    case StandardView::isometric: from = front + right + up; break;
    }
    Camera result = camera;
    result.focal_point = bounds.centre;
    result.position = bounds.centre + from * bounds.radius;
    result.up = view == StandardView::top ? -front : up;
    return fitted(result, bounds, size);
}

} // namespace pbm
