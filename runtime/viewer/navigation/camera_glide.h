// Moves a camera smoothly from one view to another.
// Based on: Shoemake. Animating Rotation with Quaternion Curves. 1985
#pragma once

#include "pbm_render/camera/camera.h"

#include <glm/gtc/quaternion.hpp>

namespace pbm {

// A move that begins and ends slowly. The axes of the eye turn about one axis, the focal point moves on a line, and the
// height of the view changes by equal factors in equal steps. The camera depends on the time alone, not on the frame
// rate. Times are seconds of any clock.
class CameraGlide {
  public:
    static constexpr double kDuration = 0.25;

    // Needs usable cameras. Projection and angle of view are those of `to` from the start.
    CameraGlide(const Camera &from, const Camera &to, double now);

    bool is_done(double now) const { return now >= begin_ + kDuration; }
    // From the end on, exactly the camera `to`.
    Camera at(double now) const;

  private:
    // The other way to write a camera.
    struct Pose {
        glm::dquat turn; // from the axes of model space to right, up, backward
        glm::dvec3 focal_point;
        double height; // of the view in the focal point's plane
    };
    static Pose pose_of(const Camera &camera);

    const Camera to_;
    const Pose first_, last_;
    const double begin_;
};

} // namespace pbm
