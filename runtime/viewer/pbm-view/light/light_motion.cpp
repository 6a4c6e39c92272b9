#include "viewer/pbm-view/light/light_motion.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

constexpr double kSteepest = 1.5533; // 89 degrees: straight up has no azimuth
constexpr double kRaking = 0.9986;   // sine of 87 degrees: light from the side still reaches the surface

glm::dvec3 vector(const std::array<float, 3> &v) { return {v[0], v[1], v[2]}; }

std::array<float, 3> floats(const glm::dvec3 &v) {
    const glm::vec3 f(v);
    return {f.x, f.y, f.z};
}

// Away from the centre towards a bearing, then the directions of growing azimuth and growing height.
glm::dmat3 axes_at(const LightFrame &frame, const LightBearing &at) {
    const glm::dvec3 level = std::sin(at.azimuth) * frame.right + std::cos(at.azimuth) * frame.front;
    const glm::dvec3 out = std::cos(at.height) * level + std::sin(at.height) * frame.up;
    const glm::dvec3 along = std::cos(at.azimuth) * frame.right - std::sin(at.azimuth) * frame.front;
    return {out, along, glm::cross(out, along)};
}

LightBearing bearing(const LightFrame &frame, const glm::dvec3 &from, double distance) {
    const double length = glm::length(from);
    if (!(length > 0))
        return {.azimuth = 0, .height = 0, .distance = distance};
    return {.azimuth = std::atan2(glm::dot(from, frame.right), glm::dot(from, frame.front)),
            .height = std::asin(std::clamp(glm::dot(from, frame.up) / length, -1.0, 1.0)),
            .distance = distance};
}

// The light at a bearing that is not clamped.
Light placed(const Light &light, const LightFrame &frame, const LightBearing &to) {
    Light moved = light;
    const glm::dmat3 axes = axes_at(frame, to);
    if (light.kind == LightKind::directional) {
        moved.direction = floats(-axes[0]);
        return moved;
    }
    moved.position = floats(frame.centre + to.distance * frame.radius * axes[0]);
    if (light.kind == LightKind::spot) {
        const glm::dmat3 turn = axes * glm::transpose(axes_at(frame, bearing_of(light, frame)));
        moved.direction = floats(glm::normalize(turn * vector(light.direction)));
    }
    return moved;
}

} // namespace

LightFrame light_frame(const Grid &grid, const Sphere &bounds, UpAxis up) {
    const EyeAxes eye = front_axes(up);
    return {.centre = bounds.centre - glm::dvec3(grid.origin[0], grid.origin[1], grid.origin[2]),
            .radius = bounds.radius,
            .right = eye.right,
            .up = eye.up,
            .front = -eye.forward};
}

LightBearing bearing_of(const Light &light, const LightFrame &frame) {
    if (light.kind == LightKind::directional)
        return bearing(frame, -vector(light.direction), 1);
    const glm::dvec3 from = vector(light.position) - frame.centre;
    return bearing(frame, from, glm::length(from) / frame.radius);
}

Light moved_to(const Light &light, const LightFrame &frame, LightBearing to) {
    to.height = std::clamp(to.height, -kSteepest, kSteepest);
    to.distance = std::max(0.0, to.distance);
    return placed(light, frame, to);
}

Light moved_towards(const Light &light, const LightFrame &frame, const glm::dvec3 &from) {
    return placed(light, frame, bearing(frame, from, bearing_of(light, frame).distance));
}

Light aimed_at_centre(Light light, const LightFrame &frame) {
    const glm::dvec3 way = frame.centre - vector(light.position);
    if (glm::length(way) > 0)
        light.direction = floats(glm::normalize(way));
    return light;
}

glm::dvec3 raking_direction(const EyeAxes &axes, glm::dvec2 pointer) {
    const double reach = glm::length(pointer);
    const glm::dvec2 at = reach > kRaking ? pointer * (kRaking / reach) : pointer;
    return at.x * axes.right + at.y * axes.up - std::sqrt(1 - glm::dot(at, at)) * axes.forward;
}

bool same_place(const Light &a, const Light &b) {
    return a.kind == b.kind && (a.kind == LightKind::point || a.direction == b.direction) &&
           (a.kind == LightKind::directional || a.position == b.position);
}

} // namespace pbm
