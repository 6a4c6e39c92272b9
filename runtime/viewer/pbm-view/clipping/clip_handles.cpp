#include "viewer/pbm-view/clipping/clip_handles.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

constexpr double kNormalLength = 0.5; // radii of the model
constexpr double kThinnestBox = 1e-3; // radii of the model
constexpr int kCircleSegments = 48;

struct Ray {
    glm::dvec3 origin, direction;
};

Ray ray_through(const PictureSpace &space, glm::dvec2 pixel) {
    const glm::dvec3 eye = space.point(pixel, 0);
    return {eye, space.point(pixel, 1) - eye};
}

// How far the point of the line from `from` along the unit vector `along` that is nearest to the ray is from `from`.
std::optional<double> nearest_along(const Ray &ray, const glm::dvec3 &from, const glm::dvec3 &along) {
    const glm::dvec3 direction = glm::normalize(ray.direction), apart = from - ray.origin;
    const double across = glm::dot(direction, along);
    if (1 - across * across < 1e-6)
        return std::nullopt; // the line is seen as a point
    return (across * glm::dot(direction, apart) - glm::dot(along, apart)) / (1 - across * across);
}

// The point of a sphere under the ray, on the side of the sphere that `side` lies on; beside the sphere that of its
// outline.
glm::dvec3 on_sphere(const Ray &ray, const glm::dvec3 &centre, double radius, const glm::dvec3 &side) {
    const glm::dvec3 direction = glm::normalize(ray.direction);
    const glm::dvec3 middle = ray.origin + direction * glm::dot(centre - ray.origin, direction);
    const glm::dvec3 off = middle - centre;
    const double rest = radius * radius - glm::dot(off, off);
    if (rest <= 0)
        return centre + glm::normalize(off) * radius;
    return middle + direction * std::copysign(std::sqrt(rest), glm::dot(side - middle, direction));
}

glm::dvec3 tip_of(const ClipPlane &plane, double radius) {
    return plane.point + glm::normalize(plane.normal) * (kNormalLength * radius);
}

int axis_of(ClipHandle face) { return (static_cast<int>(face) - static_cast<int>(ClipHandle::least_x)) / 2; }
bool is_least(ClipHandle face) { return (static_cast<int>(face) - static_cast<int>(ClipHandle::least_x)) % 2 == 0; }

glm::dvec3 middle_of(const ClipBox &box, ClipHandle face) {
    glm::dvec3 middle = (box.least + box.most) * 0.5;
    middle[axis_of(face)] = (is_least(face) ? box.least : box.most)[axis_of(face)];
    return middle;
}

} // namespace

ClipPlane first_clip_plane(const Camera &camera, const Sphere &bounds) {
    const glm::dvec3 forward = eye_axes(camera).forward, size = glm::abs(forward);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    glm::dvec3 normal(0);
    normal[axis] = forward[axis] < 0 ? -1 : 1;
    return {bounds.centre, normal};
}

ClipBox first_clip_box(const Sphere &bounds) { return {bounds.centre - bounds.radius, bounds.centre + bounds.radius}; }

std::vector<HandlePlace> clip_handles(const ClipRegion &region, double radius) {
    std::vector<HandlePlace> handles;
    if (region.plane) {
        handles.push_back({ClipHandle::plane, region.plane->point});
        handles.push_back({ClipHandle::normal, tip_of(*region.plane, radius)});
    }
    if (region.box)
        for (const ClipHandle face : {ClipHandle::least_x, ClipHandle::most_x, ClipHandle::least_y, ClipHandle::most_y,
                                      ClipHandle::least_z, ClipHandle::most_z})
            handles.push_back({face, middle_of(*region.box, face)});
    return handles;
}

std::vector<std::array<glm::dvec3, 2>> clip_outline(const ClipRegion &region, double radius) {
    std::vector<std::array<glm::dvec3, 2>> lines;
    if (region.plane) {
        const glm::dvec3 normal = glm::normalize(region.plane->normal);
        const glm::dvec3 other = std::abs(normal.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
        const glm::dvec3 u = glm::normalize(glm::cross(normal, other)), v = glm::cross(normal, u);
        const auto on_circle = [&](int i) {
            const double angle = glm::two_pi<double>() * i / kCircleSegments;
            return region.plane->point + radius * (std::cos(angle) * u + std::sin(angle) * v);
        };
        for (int i = 0; i < kCircleSegments; ++i)
            lines.push_back({on_circle(i), on_circle(i + 1)});
        lines.push_back({region.plane->point, tip_of(*region.plane, radius)});
    }
    if (region.box)
        for (int axis = 0; axis < 3; ++axis)
            for (int edge = 0; edge < 4; ++edge) {
                glm::dvec3 from = region.box->least;
                for (int bit = 0; bit < 2; ++bit)
                    if ((edge >> bit & 1) != 0)
                        from[(axis + 1 + bit) % 3] = region.box->most[(axis + 1 + bit) % 3];
                glm::dvec3 to = from;
                to[axis] = region.box->most[axis];
                lines.push_back({from, to});
            }
    return lines;
}

std::optional<ClipHandle> handle_at(const std::vector<HandlePlace> &handles, const PictureSpace &space,
                                    glm::dvec2 pixel, double reach) {
    std::optional<ClipHandle> nearest;
    for (const auto &[handle, point] : handles) {
        const PictureSpace::Place place = space.place(point);
        if (place.depth > 0 && glm::distance(place.pixel, pixel) <= reach) {
            reach = glm::distance(place.pixel, pixel);
            nearest = handle;
        }
    }
    return nearest;
}

ClipRegion after_handle_drag(ClipRegion region, ClipHandle handle, double radius, const PictureSpace &space,
                             glm::dvec2 pixel) {
    const Ray ray = ray_through(space, pixel);
    if (handle == ClipHandle::plane) {
        const glm::dvec3 normal = glm::normalize(region.plane->normal);
        region.plane->point += normal * nearest_along(ray, region.plane->point, normal).value_or(0);
    } else if (handle == ClipHandle::normal) {
        const glm::dvec3 tip = tip_of(*region.plane, radius);
        region.plane->normal =
            glm::normalize(on_sphere(ray, region.plane->point, kNormalLength * radius, tip) - region.plane->point);
    } else {
        const int axis = axis_of(handle);
        glm::dvec3 along(0);
        along[axis] = 1;
        const double moved = nearest_along(ray, middle_of(*region.box, handle), along).value_or(0);
        double &least = region.box->least[axis], &most = region.box->most[axis];
        if (is_least(handle))
            least = std::min(least + moved, most - kThinnestBox * radius);
        else
            most = std::max(most + moved, least + kThinnestBox * radius);
    }
    return region;
}

} // namespace pbm
