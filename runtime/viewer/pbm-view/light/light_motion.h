// Moves lights round a model: pure functions of a light and the model's frame. Angles are radians.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/camera.h"
#include "pbm_render/camera/framing.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace pbm {

// The sphere around a model, in model units from the grid's minimum corner as lights have it, and the axes of the eye
// of front_axes: of the default camera, or of any camera for lights that follow the eye.
struct LightFrame {
    glm::dvec3 centre{0};
    double radius = 1;
    glm::dvec3 right{1, 0, 0}, up{0, 1, 0}, front{0, 0, 1};
};
LightFrame light_frame(const Grid &grid, const Sphere &bounds, UpAxis up);

// Where a light comes from, as seen from the centre.
struct LightBearing {
    double azimuth = 0;  // to the right of the front
    double height = 0;   // above the plane of right and front
    double distance = 1; // radii of the model; of a directional light always 1
};
LightBearing bearing_of(const Light &light, const LightFrame &frame);

// The light at another bearing. A spot turns with its position, so that it aims at the same place of a model that turns
// with both. The height is clamped to almost straight up or down.
Light moved_to(const Light &light, const LightFrame &frame, LightBearing to);
// The same for a light that comes from the direction `from`, at the same distance. Any length but zero.
Light moved_towards(const Light &light, const LightFrame &frame, const glm::dvec3 &from);
// The spot light, turned towards the centre.
Light aimed_at_centre(Light light, const LightFrame &frame);

// Raking light: the direction towards a light whose reflection a ball that fills the picture shows at `pointer` (right,
// up; half picture heights from the picture's middle) to an eye with these axes. In the middle the light comes from the
// eye, at the border from the side.
glm::dvec3 raking_direction(const EyeAxes &axes, glm::dvec2 pointer);

// Whether both cast the same shadows.
bool same_place(const Light &a, const Light &b);

} // namespace pbm
