#include "viewer/cameras/camera_path.h"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

glm::dmat4 matrix_at(const PathNode &node, double time) {
    if (!node.has_parts)
        return node.matrix;
    std::array<glm::dvec4, 3> part = node.rest;
    for (std::size_t i = 0; i < part.size(); ++i)
        if (node.keys[i])
            part[i] = node.keys[i]->at(time);
    const glm::dvec4 &turn = part[1];
    const double length = glm::length(turn);
    glm::dmat4 matrix =
        length > 0 ? glm::mat4_cast(glm::dquat(turn.w, turn.x, turn.y, turn.z) / length) : glm::dmat4(1);
    for (int axis = 0; axis < 3; ++axis)
        matrix[axis] *= part[2][axis];
    matrix[3] = glm::dvec4(glm::dvec3(part[0]), 1);
    return matrix;
}

// Cuts off what the lens does not see, by the one plane that a view has.
void clip(const Lens &lens, const Extent &extent, ViewOptions &view, const glm::dvec3 &forward) {
    if (view.clip.plane)
        return;
    const double middle = glm::dot(extent.sphere.centre - *view.position, forward);
    const double first = middle - extent.sphere.radius, last = middle + extent.sphere.radius;
    if ((lens.orthographic ? first : std::max(first, 0.0)) < lens.nearest && last > 0)
        view.clip.plane = ClipPlane{*view.position + lens.nearest * forward, forward};
    else if (last > lens.farthest)
        view.clip.plane = ClipPlane{*view.position + lens.farthest * forward, -forward};
}

} // namespace

int frame_count(const CameraPath &path, double fps) {
    constexpr double kRounding = 1e-3; // of a frame: times are stored as floats
    return static_cast<int>(std::min((path.end - path.begin) * fps + kRounding, 1e6)) + 1;
}

double frame_time(const CameraPath &path, int frame, double fps) {
    return std::min(path.begin + (frame - 1) / fps, path.end);
}

ViewOptions view_at(const CameraPath &path, double time, const Extent &extent, UpAxis up, ViewOptions view) {
    const EyeAxes axes = front_axes(up);
    const glm::dmat3 to_model(axes.right, axes.up, -axes.forward);
    glm::dmat4 matrix(1);
    for (const PathNode &node : path.nodes)
        matrix = matrix * matrix_at(node, time);
    const glm::dvec3 forward = glm::normalize(to_model * -glm::dvec3(matrix[2]));
    view.position = to_model * glm::dvec3(matrix[3]);
    view.view_up = glm::normalize(to_model * glm::dvec3(matrix[1]));
    view.orthographic = path.lens.orthographic;
    const double size = path.lens.zoom ? path.lens.zoom->at(time).x : path.lens.size;
    const double ahead = glm::dot(extent.sphere.centre - *view.position, forward);
    double distance = ahead > 0 ? ahead : std::max(extent.sphere.radius, 1.0);
    if (view.orthographic)
        distance = size / std::tan(glm::radians(view.view_angle) / 2);
    else
        view.view_angle = glm::degrees(size);
    view.focal_point = *view.position + distance * forward;
    clip(path.lens, extent, view, forward);
    return view;
}

} // namespace pbm
