#include "viewer/scene/look.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <cmath>

namespace pbm {

Appearance appearance_for(const Look &look) {
    Appearance appearance = look.appearance;
    appearance.lights_follow = look.lights_follow();
    if (!look.options.headlight)
        return appearance;
    const double right = glm::radians(look.options.headlight->right), up = glm::radians(look.options.headlight->up);
    const EyeAxes axes = front_axes(appearance.up);
    const glm::vec3 from(std::cos(up) * (std::sin(right) * axes.right - std::cos(right) * axes.forward) +
                         std::sin(up) * axes.up);
    appearance.lights = {{.kind = LightKind::directional, .direction = {-from.x, -from.y, -from.z}}};
    appearance.lights_follow = LightsFollow::eye;
    return appearance;
}

Look with_fixed_lights(Look look, const Camera &camera, const Grid &grid) {
    Appearance &appearance = look.appearance;
    const auto shadows = appearance.shadows;
    appearance.lights_follow = look.lights_follow();
    appearance = turn_lights(eye_axes(camera), grid, std::move(appearance));
    appearance.shadows = shadows;
    look.options.lights_follow = std::nullopt;
    return look;
}

} // namespace pbm
