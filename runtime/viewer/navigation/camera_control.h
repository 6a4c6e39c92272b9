// How input moves a camera: pure functions of the camera and the input.
//
//   orbit  the target camera: rotates around its focal point; drags grab the model
//   fly    the flying camera: rotates in place; keys and wheel move it along its view direction. An orthographic camera
//          shows no motion along it: there they scale the view
//
// Input cannot lose the model: the focal point of the target camera stays within the model's bounding sphere, and its
// distance within 1/1000 and 100 radii of it; the flying camera stays within 100 radii of the sphere's centre. A camera
// that starts beyond a limit may stay there, but moves no further.
#pragma once

#include "pbm_render/camera/camera.h"
#include "pbm_render/camera/framing.h"

#include <glm/vec2.hpp>

#include <array>
#include <optional>

namespace pbm {

enum class CameraMode { orbit, fly };

// Rotates around the focal point, radians: the eye moves right, about `axis`, and up until it stands right above or
// below the focal point. There the picture's up direction is horizontal; elsewhere it is that of `axis`.
Camera orbit(const Camera &camera, const glm::dvec3 &axis, double right, double up);
// Rotates the whole view about `axis` through the focal point, radians: the eye moves right. Unlike `orbit`, a full
// turn ends at the same view, even from above.
Camera turntable(const Camera &camera, const glm::dvec3 &axis, double angle);
// Scales the view about a point of model space, which stays where it is in the picture. The distance to the focal point
// is clamped to 1/1000..100 radii of the model.
Camera approach(const Camera &camera, const glm::dvec3 &anchor, double factor, double model_radius);
// Moves eye and focal point parallel to the picture: the focal point's plane moves by `offset` (right, up; picture
// heights).
Camera pan(const Camera &camera, glm::dvec2 offset);
// Rotates in place, radians: the view moves right, about `axis`, and up until along `axis`.
Camera turn(const Camera &camera, const glm::dvec3 &axis, double right, double up);
// Moves eye and focal point right and along the view direction; model units.
Camera advance(const Camera &camera, double right, double forward);
// Moves eye and focal point so that `point` becomes the focal point at its present depth, and size in the picture.
Camera focused(const Camera &camera, const glm::dvec3 &point);

enum class Drag { turn, pan, distance };

// What input means for a model.
struct Steering {
    CameraMode mode;
    glm::dvec3 axis; // that the camera turns about: up, any length
    Sphere bounds;   // of the model
};

// The mouse was dragged by `offset` (right, up; picture heights).
Camera after_drag(const Camera &camera, const Steering &steering, Drag drag, glm::dvec2 offset);
// The wheel was turned by `notches` away from the user: moves nearer to `anchor`, which stays where it is in the
// picture. The flying camera flies towards it.
Camera after_wheel(const Camera &camera, const Steering &steering, double notches, const glm::dvec3 &anchor);
// Arrow keys, in steps right and up. Up moves nearer, or along the view direction.
Camera after_arrows(const Camera &camera, const Steering &steering, glm::dvec2 steps);

enum class Arrow { left, right, up, down };

// Motion by arrow keys, independent of the keyboard's repeat rate: one step when a key is pressed and, after a short
// pause, steady motion while it is held. Times are seconds of any clock.
class HeldArrows {
  public:
    void press(Arrow arrow, double now);
    void release(Arrow arrow, double now);

    // Time of the next motion to draw; absent while no key is held.
    std::optional<double> next_step(double now) const;
    // Steps right and up since the last call.
    glm::dvec2 take_steps(double now);

  private:
    struct Key {
        bool held = false;
        double moves_from = 0; // start of the steady motion not yet taken
    };
    void collect(double now);

    std::array<Key, 4> keys_;
    glm::dvec2 steps_{0};
};

} // namespace pbm
