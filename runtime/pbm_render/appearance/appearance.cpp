#include "pbm_render/appearance/appearance.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace pbm {
namespace {

std::array<float, 3> floats(const glm::dvec3 &v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

glm::dvec3 vector(const std::array<float, 3> &v) { return {v[0], v[1], v[2]}; }

// To model space, from right, up and towards the eye.
glm::dmat3 matrix(const EyeAxes &axes) { return {axes.right, axes.up, -axes.forward}; }

// A light from beside the eye of front_axes(up). `travel`: to the right, up and towards the eye.
Light light_beside_eye(UpAxis up, const glm::dvec3 &travel, float intensity) {
    return {.intensity = {intensity, intensity, intensity},
            .direction = floats(matrix(front_axes(up)) * glm::normalize(travel))};
}

// The soft light: this share of it comes from everywhere, the rest from the upper left, by cosine.
constexpr float kFromEverywhere = 0.55F;
const glm::dvec3 kSoftTravel{0.45, -0.45, -0.77};

// Together they show a surface that faces the eye in its own colour. A material that has more of its light from
// everywhere, since it emits some of it, keeps that share. Materials that scatter no light stay.
void soften(Appearance &appearance) {
    appearance.lights = {light_beside_eye(appearance.up, kSoftTravel, 1)};
    const auto towards_eye = static_cast<float>(-glm::normalize(kSoftTravel).z);
    for (Material &material : appearance.materials)
        if (material.kd > 0) {
            material.ka = std::max(material.ka, kFromEverywhere);
            material.kd = (1 - material.ka) / towards_eye;
        }
}

void light_evenly(Appearance &appearance) {
    appearance.lights.clear();
    for (Material &material : appearance.materials) {
        material.ka = 1;
        material.kd = material.ks = material.environment = 0;
    }
}

} // namespace

std::vector<Light> default_lights(UpAxis up) {
    return {light_beside_eye(up, {0.62, -0.6, -0.52}, 1.1F), light_beside_eye(up, {-0.85, -0.05, -0.4}, 0.18F)};
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

Rgba8 background_at(const RenderOptions &options, double down) {
    Rgba8 colour = options.background;
    if (options.background_below)
        for (std::size_t i = 0; i < colour.size(); ++i)
            colour[i] =
                static_cast<std::uint8_t>(std::lround(colour[i] + down * ((*options.background_below)[i] - colour[i])));
    return colour;
}

void clear(const RenderOptions &options, Framebuffer &picture) {
    picture.clear(options.background);
    if (options.background_below)
        for (std::size_t at = 0; at < picture.pixels(); ++at)
            picture.colour[at] =
                pack_rgba(background_at(options, static_cast<double>(picture.centre(at).y) / picture.height));
}

ColourSource colour_source(const AttributeSet &set, const RenderOptions &options) {
    if (palette_stream(set) && options.texture)
        return ColourSource::texture;
    if (!options.point_colours || set.colour == ColourFormat::none)
        return ColourSource::material;
    return set.colour == ColourFormat::rgb888 ? ColourSource::rgb888 : ColourSource::rgb565;
}

Appearance appearance_in_frame(const ModelParameters &parameters, const RenderOptions &options, const EyeAxes &eye,
                               Appearance appearance) {
    const ColourSource source = colour_source(parameters.attributes, options);
    const bool shows_photographs =
        !appearance.has_one_colour && (source == ColourSource::rgb565 || source == ColourSource::rgb888);
    const bool is_unedited = appearance.lights_follow == LightsFollow::eye &&
                             appearance.lights == default_lights(appearance.up) &&
                             appearance.materials == parameters.materials;
    if (options.shading == Shading::unlit)
        light_evenly(appearance);
    else if (options.shading == Shading::automatic && shows_photographs && is_unedited)
        soften(appearance);
    return turn_lights(eye, parameters.grid, std::move(appearance));
}

} // namespace pbm
