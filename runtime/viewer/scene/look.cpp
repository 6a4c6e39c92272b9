#include "viewer/scene/look.h"

#include <glm/trigonometric.hpp>

namespace pbm {

Appearance appearance_for(const Look &look) {
    Appearance appearance = look.appearance;
    appearance.lights_follow = look.lights_follow();
    if (look.options.headlight)
        set_headlight(appearance, glm::radians(look.options.headlight->right),
                      glm::radians(look.options.headlight->up));
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
