#include "viewer/navigation/camera_control.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

constexpr double kPi = glm::pi<double>();
constexpr double kPole = 0.01;                     // radians; nearer to the axis it does not tell the picture's up
constexpr double kNearest = 1e-3, kFarthest = 100; // radii of the model

constexpr double kTurnPerHeight = kPi;         // a drag over the picture's height rotates by half a turn
constexpr double kLookPerHeight = kPi / 3;     // ... or rotates the flying camera
constexpr double kDistancePerHeight = 10;      // ... or multiplies the distance by ten
constexpr double kDistancePerNotch = 0.9;      // factor
constexpr double kDistancePerStep = 0.95;      // factor
constexpr double kTurnPerStep = 5 * kPi / 180; // radians
constexpr double kFlightPerStep = 0.05;        // radii of the model
constexpr double kFlightPerNotch = 0.1;        // radii of the model

constexpr double kHoldPause = 0.25; // seconds until a held key moves steadily
constexpr double kStepsPerSecond = 20;
constexpr double kStepInterval = 1.0 / 60; // seconds; screens show no more

constexpr std::array<glm::dvec2, 4> kDirections{{{-1, 0}, {1, 0}, {0, 1}, {0, -1}}}; // of Arrow

// Rodrigues' formula; `axis` of length 1.
glm::dvec3 rotate(const glm::dvec3 &v, const glm::dvec3 &axis, double angle) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    return v * c + glm::cross(axis, v) * s + axis * (glm::dot(axis, v) * (1 - c));
}

struct Turned {
    glm::dvec3 sight, up;
};

// Rotates `sight` about `axis`, then raises it towards `axis`. Near the poles the picture's `up` tells the direction in
// which `sight` leaves them.
Turned turned(const glm::dvec3 &sight, const glm::dvec3 &up, const glm::dvec3 &axis, double about, double raise) {
    const glm::dvec3 pole = glm::normalize(axis);
    const auto level_part = [&](const glm::dvec3 &v) { return v - pole * glm::dot(v, pole); };
    const double length = glm::length(sight), along = glm::dot(sight, pole);
    const double from_pole = std::atan2(glm::length(level_part(sight)), along);
    const auto is_polar = [](double angle) { return std::sin(angle) < std::sin(kPole); };
    glm::dvec3 level = level_part(sight);
    if (is_polar(from_pole) && glm::length(level_part(up)) > 0.5 * glm::length(up))
        level = level_part(along > 0 ? -up : up);
    level = rotate(glm::normalize(level), pole, about);
    const double target = std::clamp(from_pole - raise, 0.0, kPi);
    return {length * (std::cos(target) * pole + std::sin(target) * level), !is_polar(target) ? axis
                                                                           : target < 1      ? -level
                                                                                             : level};
}

Camera shifted(Camera camera, const glm::dvec3 &shift) {
    camera.position += shift;
    camera.focal_point += shift;
    return camera;
}

// Pulls a camera back that has left the reach, see the header.
Camera within_reach(const Camera &before, const Camera &after, const Steering &steering) {
    const bool flies = steering.mode == CameraMode::fly;
    const auto from_centre = [&](const Camera &camera) {
        return (flies ? camera.position : camera.focal_point) - steering.bounds.centre;
    };
    const double reach = std::max((flies ? kFarthest : 1) * steering.bounds.radius, glm::length(from_centre(before)));
    const glm::dvec3 away = from_centre(after);
    const double distance = glm::length(away);
    return distance <= reach ? after : shifted(after, away * (reach / distance - 1));
}

} // namespace

Camera orbit(const Camera &camera, const glm::dvec3 &axis, double right, double up) {
    Camera result = camera;
    const Turned eye = turned(camera.position - camera.focal_point, camera.up, axis, right, up);
    result.position = camera.focal_point + eye.sight;
    result.up = eye.up;
    return result;
}

Camera turntable(const Camera &camera, const glm::dvec3 &axis, double angle) {
    if (angle == 0)
        return camera; // exactly
    const glm::dvec3 unit = glm::normalize(axis);
    Camera result = camera;
    result.position = camera.focal_point + rotate(camera.position - camera.focal_point, unit, angle);
    result.up = rotate(camera.up, unit, angle);
    return result;
}

Camera approach(const Camera &camera, const glm::dvec3 &anchor, double factor, double model_radius) {
    const glm::dvec3 from_focus = camera.position - camera.focal_point;
    const double distance = glm::length(from_focus);
    const double nearest = std::min(distance, kNearest * model_radius);
    const double farthest = std::max(distance, kFarthest * model_radius);
    const double scale = std::clamp(distance * factor, nearest, farthest) / distance;
    Camera result = camera;
    result.focal_point += (1 - scale) * (anchor - camera.focal_point);
    result.position = result.focal_point + from_focus * scale;
    return result;
}

Camera pan(const Camera &camera, glm::dvec2 offset) {
    const EyeAxes axes = eye_axes(camera);
    const double distance = glm::length(camera.focal_point - camera.position);
    const double height = 2 * distance * std::tan(camera.view_angle / 2);
    return shifted(camera, -height * (axes.right * offset.x + axes.up * offset.y));
}

Camera turn(const Camera &camera, const glm::dvec3 &axis, double right, double up) {
    Camera result = camera;
    const Turned view = turned(camera.focal_point - camera.position, camera.up, axis, -right, up);
    result.focal_point = camera.position + view.sight;
    result.up = view.up;
    return result;
}

Camera advance(const Camera &camera, double right, double forward) {
    const EyeAxes axes = eye_axes(camera);
    return shifted(camera, axes.right * right + axes.forward * forward);
}

Camera focused(const Camera &camera, const glm::dvec3 &point) {
    const glm::dvec3 forward = eye_axes(camera).forward;
    // An orthographic camera shows all depths in the same size.
    const double distance = camera.orthographic ? glm::length(camera.focal_point - camera.position)
                                                : glm::dot(point - camera.position, forward);
    Camera result = camera;
    result.focal_point = point;
    result.position = point - distance * forward;
    return result;
}

Camera after_drag(const Camera &camera, const Steering &steering, Drag drag, glm::dvec2 offset) {
    const auto [mode, axis, bounds] = steering;
    switch (drag) {
    case Drag::pan: return within_reach(camera, pan(camera, offset), steering);
    case Drag::distance:
        return within_reach(
            camera, approach(camera, camera.focal_point, std::pow(kDistancePerHeight, -offset.y), bounds.radius),
            steering);
    case Drag::turn: break;
    }
    if (mode == CameraMode::fly)
        return turn(camera, axis, kLookPerHeight * offset.x, kLookPerHeight * offset.y);
    return orbit(camera, axis, -kTurnPerHeight * offset.x, -kTurnPerHeight * offset.y);
}

Camera after_wheel(const Camera &camera, const Steering &steering, double notches, const glm::dvec3 &anchor) {
    const double radius = steering.bounds.radius;
    if (steering.mode == CameraMode::orbit || camera.orthographic)
        return within_reach(camera, approach(camera, anchor, std::pow(kDistancePerNotch, notches), radius), steering);
    const glm::dvec3 towards = glm::normalize(anchor - camera.position);
    return within_reach(camera, shifted(camera, towards * (notches * kFlightPerNotch * radius)), steering);
}

Camera after_arrows(const Camera &camera, const Steering &steering, glm::dvec2 steps) {
    const double radius = steering.bounds.radius, stride = kFlightPerStep * radius;
    if (steering.mode == CameraMode::fly && !camera.orthographic)
        return within_reach(camera, advance(camera, steps.x * stride, steps.y * stride), steering);
    const Camera moved = steering.mode == CameraMode::fly ? advance(camera, steps.x * stride, 0)
                                                          : orbit(camera, steering.axis, kTurnPerStep * steps.x, 0);
    return within_reach(camera, approach(moved, moved.focal_point, std::pow(kDistancePerStep, steps.y), radius),
                        steering);
}

void HeldArrows::press(Arrow arrow, double now) {
    collect(now);
    Key &key = keys_[static_cast<std::size_t>(arrow)];
    if (key.held)
        return;
    key = {true, now + kHoldPause};
    steps_ += kDirections[static_cast<std::size_t>(arrow)];
}

void HeldArrows::release(Arrow arrow, double now) {
    collect(now);
    keys_[static_cast<std::size_t>(arrow)].held = false;
}

std::optional<double> HeldArrows::next_step(double now) const {
    std::optional<double> next;
    for (const Key &key : keys_)
        if (key.held) {
            const double at = std::max(key.moves_from, now) + kStepInterval;
            next = next ? std::min(*next, at) : at;
        }
    return next;
}

glm::dvec2 HeldArrows::take_steps(double now) {
    collect(now);
    return std::exchange(steps_, glm::dvec2(0));
}

void HeldArrows::collect(double now) {
    for (std::size_t i = 0; i < keys_.size(); ++i)
        if (keys_[i].held && now > keys_[i].moves_from) {
            steps_ += kDirections[i] * ((now - keys_[i].moves_from) * kStepsPerSecond);
            keys_[i].moves_from = now;
        }
}

} // namespace pbm
