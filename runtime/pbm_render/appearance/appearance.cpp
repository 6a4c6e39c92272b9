#include "pbm_render/appearance/appearance.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <cmath>

namespace pbm {
namespace {

std::array<float, 3> floats(const glm::dvec3 &v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

glm::dvec3 vector(const std::array<float, 3> &v) { return {v[0], v[1], v[2]}; }

// To model space, from right, up and towards the eye.
glm::dmat3 matrix(const EyeAxes &axes) { return {axes.right, axes.up, -axes.forward}; }

} // namespace

std::vector<Light> default_lights(UpAxis up) {
    const auto light = [axes = matrix(front_axes(up))](const glm::dvec3 &travel, float intensity) {
        return Light{.intensity = {intensity, intensity, intensity},
                     .direction = floats(axes * glm::normalize(travel))};
    };
    return {light({0.62, -0.6, -0.52}, 1.1F), light({-0.85, -0.05, -0.4}, 0.18F)};
}

std::optional<StreamInfo> palette_stream(const AttributeSet &set) {
    return set.texture ? std::optional(StreamInfo{StreamKind::texture}) : std::nullopt;
}

Appearance::Appearance(const ModelParameters &parameters)
    : materials(parameters.materials), lights(parameters.lights), up(parameters.grid.up) {
    if (lights.empty()) {
        lights = default_lights(up);
        lights_follow = LightsFollow::eye;
    }
    if (!parameters.texture.empty())
        palette = parameters.texture.front().palette;
    if (parameters.ground && parameters.ground->texture)
        ground_palette = parameters.ground->texture->palette;
}

void set_headlight(Appearance &appearance, double right, double up) {
    const EyeAxes axes = front_axes(appearance.up);
    const glm::vec3 from(std::cos(up) * (std::sin(right) * axes.right - std::cos(right) * axes.forward) +
                         std::sin(up) * axes.up);
    appearance.lights = {{.kind = LightKind::directional, .direction = {-from.x, -from.y, -from.z}}};
    appearance.lights_follow = LightsFollow::eye;
}

std::vector<Light> lights_to_keep(const Appearance &appearance, const ModelParameters &file) {
    const bool are_default = file.lights.empty() && appearance.lights == default_lights(appearance.up);
    return are_default ? std::vector<Light>() : appearance.lights;
}

Appearance turn_lights(const EyeAxes &eye, const Grid &grid, Appearance appearance) {
    if (appearance.lights_follow == LightsFollow::model)
        return appearance;
    const glm::dmat3 turn = matrix(eye) * glm::transpose(matrix(front_axes(appearance.up)));
    const glm::dvec3 centre(grid.edge() / 2);
    for (Light &light : appearance.lights) {
        light.direction = floats(turn * vector(light.direction));
        light.position = floats(centre + turn * (vector(light.position) - centre));
    }
    appearance.shadows.fill({.of_file = false, .fresh = nullptr});
    appearance.lights_follow = LightsFollow::model;
    return appearance;
}

} // namespace pbm
