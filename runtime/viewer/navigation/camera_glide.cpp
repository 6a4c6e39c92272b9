#include "viewer/navigation/camera_glide.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {

CameraGlide::CameraGlide(const Camera &from, const Camera &to, double now)
    : to_(to), first_(pose_of(from)), last_(pose_of(to)), begin_(now) {}

CameraGlide::Pose CameraGlide::pose_of(const Camera &camera) {
    const EyeAxes axes = eye_axes(camera);
    return {.turn = glm::quat_cast(glm::dmat3(axes.right, axes.up, -axes.forward)),
            .focal_point = camera.focal_point,
            .height = view_height(camera)};
}

Camera CameraGlide::at(double now) const {
    if (is_done(now))
        return to_;
    const double time = std::max(0.0, now - begin_) / kDuration;
    const double part = time * time * (3 - 2 * time);
    const glm::dmat3 axes = glm::mat3_cast(glm::slerp(first_.turn, last_.turn, part));
    Camera camera = to_;
    camera.focal_point = glm::mix(first_.focal_point, last_.focal_point, part);
    const double height = first_.height * std::pow(last_.height / first_.height, part);
    camera.position = camera.focal_point + axes[2] * (height / 2 / std::tan(to_.view_angle / 2));
    camera.up = axes[1];
    return camera;
}

} // namespace pbm
