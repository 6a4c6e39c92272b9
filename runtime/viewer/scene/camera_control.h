// How input moves a camera: functions of the camera and the input, without a window.
//
//   orbit  the target camera: it turns around its focal point; drags grab the model
//   fly    the flying camera: it turns where it stands; keys and wheel move it along its view direction
#pragma once

#include "pbm_render/camera/camera.h"

#include <glm/vec2.hpp>

#include <array>
#include <optional>

namespace pbm {

enum class CameraMode { orbit, fly };

// Turns around the focal point, radians: the eye goes right, and up until it nearly stands above or below.
Camera orbit(const Camera &camera, double right, double up);
// Turns the whole view about `axis` through the focal point, radians: the eye goes right. Unlike `orbit` it comes back
// to the same view from everywhere, from above too.
Camera turntable(const Camera &camera, const glm::dvec3 &axis, double angle);
// Scales the distance to the focal point, within 1/1000 and 1000 radii of the model.
Camera approach(const Camera &camera, double factor, double model_radius);
// Moves eye and focal point in the plane of the picture: what lies in the focal point's plane moves by `offset`
// (right, up; picture heights).
Camera pan(const Camera &camera, glm::dvec2 offset);
// Turns where it stands, radians: the view goes right, and up until nearly along `Camera::up`.
Camera turn(const Camera &camera, double right, double up);
// Moves eye and focal point right and along the view direction; model units.
Camera advance(const Camera &camera, double right, double forward);

enum class Drag { turn, pan, distance };

// A drag of the mouse by `offset` (right, up; picture heights).
Camera after_drag(const Camera &camera, CameraMode mode, Drag drag, glm::dvec2 offset, double model_radius);
// The wheel, `notches` away from the user: nearer.
Camera after_wheel(const Camera &camera, CameraMode mode, double notches, double model_radius);
// Arrow keys, in steps right and up. Up: nearer, or along the view direction.
Camera after_arrows(const Camera &camera, CameraMode mode, glm::dvec2 steps, double model_radius);

enum class Arrow { left, right, up, down };

// Arrow keys as motion that does not depend on the keyboard's repeat rate: one step when a key goes down and, while it
// stays down, a steady motion after a short pause. Times are seconds of any clock.
class HeldArrows {
  public:
    void press(Arrow arrow, double now);
    void release(Arrow arrow, double now);
    bool any() const;

    // When there is motion to be drawn next; nothing while no key is held.
    std::optional<double> next_step(double now) const;
    // Steps right and up since the last call.
    glm::dvec2 take_steps(double now);

  private:
    struct Key {
        bool held = false;
        double moves_from = 0; // steady motion not yet taken starts here
    };
    void collect(double now);

    std::array<Key, 4> keys_;
    glm::dvec2 steps_{0};
};

} // namespace pbm
