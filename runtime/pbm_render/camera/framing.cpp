#include "pbm_render/camera/framing.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pbm {
namespace {

constexpr double kFlat = 1.0 / 3;
constexpr double kRaised = 30; // degrees

// Tangents of half the angle of view, of the part of the picture that a model may fill.
glm::dvec2 framed_tangents(double view_angle, glm::ivec2 size) {
    const double vertical = std::tan(view_angle / 2);
    return kFramedPart * glm::dvec2(vertical * size.x / size.y, vertical);
}

// The nearest place from which the four planes of the view, with these tangents, have everything on their inner side,
// in axes right, up, forward. `support(normal)`: minimum of dot(p, normal) over all points p. On the other axis than
// the one that decides the distance, the planes of both sides are equally far away.
template <class Support> glm::dvec3 nearest_place(glm::dvec2 tangents, const Support &support) {
    glm::dvec3 place{0, 0, std::numeric_limits<double>::infinity()};
    for (int axis = 0; axis < 2; ++axis) {
        glm::dvec3 normal{0, 0, tangents[axis]}; // forward x tangent +- sideways >= 0 inside
        normal[axis] = 1;
        const double low = support(normal);
        normal[axis] = -1;
        const double high = support(normal);
        place[axis] = (low - high) / 2;
        place.z = std::min(place.z, (low + high) / 2 / tangents[axis]);
    }
    return place;
}

// Shifts the place sideways until the projection reaches equally far on both sides.
void centre(const std::vector<glm::dvec3> &points, glm::dvec3 &place) {
    for (int step = 0; step < 8; ++step) {
        glm::dvec2 low{std::numeric_limits<double>::infinity()}, high = -low, low_depth{0}, high_depth{0};
        for (const glm::dvec3 &p : points) {
            const glm::dvec3 q = p - place;
            for (int axis = 0; axis < 2; ++axis) {
                const double at = q[axis] / q.z;
                if (at < low[axis]) {
                    low[axis] = at;
                    low_depth[axis] = q.z;
                }
                if (at > high[axis]) {
                    high[axis] = at;
                    high_depth[axis] = q.z;
                }
            }
        }
        // Moving by `shift` changes both ends by shift / depth.
        const glm::dvec2 shift = (low + high) / (1.0 / low_depth + 1.0 / high_depth);
        place += glm::dvec3(shift, 0);
        if (glm::length(low + high) < 1e-6)
            break;
    }
}

// From the front; from above where the model is flat, or its extent asks for it.
EyeAxes first_axes(const Extent &extent, UpAxis up) {
    const glm::dvec3 upwards = up_direction(up), front = front_direction(up);
    glm::dvec3 low = extent.corners.front(), high = low;
    for (const glm::dvec3 &corner : extent.corners) {
        low = glm::min(low, corner);
        high = glm::max(high, corner);
    }
    const glm::dvec3 size = high - low;
    const double height = glm::dot(size, upwards);
    const glm::dvec3 level = size - height * upwards;
    const bool is_flat = height < kFlat * std::max({level.x, level.y, level.z});
    const double raised = is_flat || extent.from_above ? glm::radians(kRaised) : 0;
    const glm::dvec3 forward = -std::cos(raised) * front - std::sin(raised) * upwards;
    const glm::dvec3 right = glm::cross(-front, upwards);
    return {.right = right, .up = glm::cross(right, forward), .forward = forward};
}

Camera frame(const EyeAxes &axes, Camera camera, const Extent &extent, glm::ivec2 size) {
    const glm::dvec2 tangents = framed_tangents(camera.view_angle, size);
    std::vector<glm::dvec3> points; // in the axes of the eye, from the centre of the sphere
    points.reserve(extent.corners.size());
    for (const glm::dvec3 &corner : extent.corners) {
        const glm::dvec3 p = corner - extent.sphere.centre;
        points.emplace_back(glm::dot(p, axes.right), glm::dot(p, axes.up), glm::dot(p, axes.forward));
    }
    if (camera.orthographic) { // as much is seen as of the focal point's plane
        glm::dvec3 low = points.front(), high = low;
        for (const glm::dvec3 &p : points) {
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
        const glm::dvec3 middle = (low + high) / 2.0, half = (high - low) / 2.0;
        camera.focal_point = extent.sphere.centre + middle.x * axes.right + middle.y * axes.up;
        camera.position = camera.focal_point - std::max(half.x / tangents.x, half.y / tangents.y) * axes.forward;
        return camera;
    }
    glm::dvec3 place = nearest_place(tangents, [&](const glm::dvec3 &normal) {
        double least = std::numeric_limits<double>::infinity();
        for (const glm::dvec3 &p : points)
            least = std::min(least, glm::dot(p, normal));
        return least;
    });
    centre(points, place);
    camera.position = extent.sphere.centre + place.x * axes.right + place.y * axes.up + place.z * axes.forward;
    camera.focal_point = camera.position - place.z * axes.forward;
    return camera;
}

} // namespace

Camera framed(const Camera &direction, const Extent &extent, int width, int height) {
    return frame(eye_axes(direction), direction, extent, {width, height});
}

Camera default_camera(const Extent &extent, UpAxis up, int width, int height, double view_angle) {
    return frame(first_axes(extent, up), {.up = up_direction(up), .view_angle = view_angle}, extent, {width, height});
}

Camera default_camera(const Model &model, int width, int height, double view_angle) {
    return default_camera(find_extent(model), model.parameters.grid.up, width, height, view_angle);
}

Camera turntable_camera(const Extent &extent, UpAxis up, int width, int height, double view_angle) {
    const EyeAxes axes = first_axes(extent, up);
    const glm::dvec3 upwards = up_direction(up);
    const double raised = glm::dot(axes.up, upwards), ahead = glm::dot(axes.forward, upwards);
    struct Circle {
        double height, radius;
    };
    std::vector<Circle> circles; // on which the corners turn
    circles.reserve(extent.corners.size());
    for (const glm::dvec3 &corner : extent.corners) {
        const glm::dvec3 p = corner - extent.sphere.centre;
        const double above = glm::dot(p, upwards);
        circles.push_back({above, glm::length(p - above * upwards)});
    }
    const glm::dvec3 place = nearest_place(framed_tangents(view_angle, {width, height}), [&](const glm::dvec3 &normal) {
        const double along = normal.y * raised + normal.z * ahead; // the part of the normal that is along the axis
        const double across = std::sqrt(std::max(0.0, glm::dot(normal, normal) - along * along));
        double least = std::numeric_limits<double>::infinity();
        for (const Circle &circle : circles)
            least = std::min(least, circle.height * along - circle.radius * across);
        return least;
    });
    return {.position = extent.sphere.centre + place.y * axes.up + place.z * axes.forward,
            // Where the line of sight meets the axis, which stands less than 90 degrees from axes.up.
            .focal_point = extent.sphere.centre + place.y / raised * upwards,
            .up = upwards,
            .view_angle = view_angle};
}

Camera camera_around(const Sphere &sphere, UpAxis up, int width, int height, double view_angle) {
    const double vertical = view_angle / 2;
    const double horizontal = std::atan(std::tan(vertical) * width / height);
    return {.position = sphere.centre + front_direction(up) * sphere.radius / std::sin(std::min(vertical, horizontal)),
            .focal_point = sphere.centre,
            .up = up_direction(up),
            .view_angle = view_angle};
}

} // namespace pbm
