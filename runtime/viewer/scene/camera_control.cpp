#include "viewer/scene/camera_control.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

constexpr double kPi = glm::pi<double>();
constexpr double kPoleMargin = kPi / 180; // minimum angle between line of sight and up axis
constexpr double kNearest = 1e-3, kFarthest = 1e3;

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

// Rotates `v` (not parallel to `up`) about `up`, then raises it towards `up` as far as the margin allows.
glm::dvec3 turned(const glm::dvec3 &v, const glm::dvec3 &up_axis, double about, double raise) {
    const glm::dvec3 up = glm::normalize(up_axis);
    const glm::dvec3 level = rotate(v, up, about);
    const double from_up = std::acos(std::clamp(glm::dot(glm::normalize(level), up), -1.0, 1.0));
    // A camera that starts within the margin may stay there, but does not go further.
    const double lowest = std::min(from_up, kPoleMargin);
    const double highest = std::max(from_up, kPi - kPoleMargin);
    const double target = std::clamp(from_up - raise, lowest, highest);
    return rotate(level, glm::normalize(glm::cross(up, level)), target - from_up);
}

Camera shifted(Camera camera, const glm::dvec3 &shift) {
    camera.position += shift;
    camera.focal_point += shift;
    return camera;
}

} // namespace

Camera orbit(const Camera &camera, double right, double up) {
    Camera result = camera;
    result.position = camera.focal_point + turned(camera.position - camera.focal_point, camera.up, right, up);
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

Camera approach(const Camera &camera, double factor, double model_radius) {
    const glm::dvec3 from_focus = camera.position - camera.focal_point;
    const double distance = glm::length(from_focus);
    const double nearest = std::min(distance, kNearest * model_radius);
    const double farthest = std::max(distance, kFarthest * model_radius);
    Camera result = camera;
    result.position = camera.focal_point + from_focus * (std::clamp(distance * factor, nearest, farthest) / distance);
    return result;
}

Camera pan(const Camera &camera, glm::dvec2 offset) {
    const EyeAxes axes = eye_axes(camera);
    const double distance = glm::length(camera.focal_point - camera.position);
    const double height = 2 * distance * std::tan(camera.view_angle / 2);
    return shifted(camera, -height * (axes.right * offset.x + axes.up * offset.y));
}

Camera turn(const Camera &camera, double right, double up) {
    Camera result = camera;
    result.focal_point = camera.position + turned(camera.focal_point - camera.position, camera.up, -right, up);
    return result;
}

Camera advance(const Camera &camera, double right, double forward) {
    const EyeAxes axes = eye_axes(camera);
    return shifted(camera, axes.right * right + axes.forward * forward);
}

Camera after_drag(const Camera &camera, CameraMode mode, Drag drag, glm::dvec2 offset, double model_radius) {
    switch (drag) {
    case Drag::pan: return pan(camera, offset);
    case Drag::distance: return approach(camera, std::pow(kDistancePerHeight, -offset.y), model_radius);
    case Drag::turn: break;
    }
    if (mode == CameraMode::fly)
        return turn(camera, kLookPerHeight * offset.x, kLookPerHeight * offset.y);
    return orbit(camera, -kTurnPerHeight * offset.x, -kTurnPerHeight * offset.y);
}

Camera after_wheel(const Camera &camera, CameraMode mode, double notches, double model_radius) {
    if (mode == CameraMode::fly)
        return advance(camera, 0, notches * kFlightPerNotch * model_radius);
    return approach(camera, std::pow(kDistancePerNotch, notches), model_radius);
}

Camera after_arrows(const Camera &camera, CameraMode mode, glm::dvec2 steps, double model_radius) {
    if (mode == CameraMode::fly)
        return advance(camera, steps.x * kFlightPerStep * model_radius, steps.y * kFlightPerStep * model_radius);
    return approach(orbit(camera, kTurnPerStep * steps.x, 0), std::pow(kDistancePerStep, steps.y), model_radius);
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
