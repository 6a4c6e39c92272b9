#include "viewer/scene/look.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <cmath>

namespace pbm {

Appearance appearance_for(const Look &look, const Camera &camera) {
    Appearance appearance = look.appearance;
    if (!look.options.headlight)
        return appearance;
    const double right = glm::radians(look.options.headlight->right), up = glm::radians(look.options.headlight->up);
    const EyeAxes axes = eye_axes(camera);
    const glm::vec3 from(std::cos(up) * (std::sin(right) * axes.right - std::cos(right) * axes.forward) +
                         std::sin(up) * axes.up);
    appearance.lights = {{.kind = LightKind::directional, .direction = {-from.x, -from.y, -from.z}}};
    appearance.shadows.fill({.of_file = false, .fresh = nullptr});
    return appearance;
}

} // namespace pbm
