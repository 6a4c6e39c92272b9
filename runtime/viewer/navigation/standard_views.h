// Views of the whole model from the front, the side, above and a corner.
#pragma once

#include "pbm_render/camera/camera.h"
#include "pbm_render/camera/framing.h"

#include <glm/vec2.hpp>

namespace pbm {

// Moves the camera back or forth, and to the model's centre, so that its bounding sphere touches the nearer borders of
// a picture of `size`. The direction stays.
Camera fitted(const Camera &camera, const Sphere &bounds, glm::ivec2 size);

// side: from the right. top: with the front at the lower border. isometric: from the front, the right and above, at
// equal angles to the three axes.
enum class StandardView { front, side, top, isometric };

// Looks at the whole model. `up` is its up axis; angle of view and projection are those of `camera`.
Camera standard_view(StandardView view, UpAxis up, const Camera &camera, const Sphere &bounds, glm::ivec2 size);

} // namespace pbm
