// A ball over a ground plane in front of a panorama whose colours follow from the direction.
#pragma once

#include "pbm_render/surroundings/surroundings.h"
#include "unit/render/fast_test_model.h"

#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace pbm::test {

// sRGB, smooth over the whole sphere. `d`: unit vector (right, up, forward) of the default camera.
inline glm::dvec3 colour_towards(glm::dvec3 d) { return 127.5 + 90.0 * d + 30.0 * glm::dvec3(d.y, d.z, d.x); }

inline glm::dmat3 panorama_axes(UpAxis up) { // from model space
    const glm::dvec3 y = up_direction(up), forward = -front_direction(up);
    return glm::transpose(glm::dmat3(glm::cross(forward, y), y, forward));
}

inline Image coloured_panorama(std::uint32_t height = 256) {
    Image image{.width = 2 * height, .height = height, .channels = 3, .texels = {}};
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < 2 * height; ++x) {
            const double longitude = ((x + 0.5) / height - 1) * std::numbers::pi;
            const double latitude = (0.5 - (y + 0.5) / height) * std::numbers::pi;
            const glm::dvec3 colour = colour_towards({std::sin(longitude) * std::cos(latitude), std::sin(latitude),
                                                      std::cos(longitude) * std::cos(latitude)});
            for (int i = 0; i < 3; ++i)
                image.texels.push_back(static_cast<std::uint8_t>(std::lround(colour[i])));
        }
    return image;
}

inline Image raster(std::uint32_t edge, std::uint8_t value) {
    return {.width = edge, .height = edge, .channels = 1, .texels = Bytes(std::size_t{edge} * edge, value)};
}

// The ball touches the plane y = -1.9 (model space), which is 3 wide and white, of a material of its own.
inline Model ball_on_ground(const AttributeSet &set) {
    Model model = smooth_ball(6, set);
    ModelParameters &parameters = model.parameters;
    parameters.ground = GroundPlane{.centre = {1, 0.1F, 1},
                                    .half_edge = 1.5F,
                                    .material = static_cast<std::uint8_t>(parameters.materials.size()),
                                    .texture = {}};
    parameters.materials.push_back(
        {.ka = 0.1F, .kd = 0.5F, .ks = 0, .power = 16, .colour = {255, 255, 255}, .environment = 0});
    parameters.lights.resize(std::max<std::size_t>(1, parameters.lights.size()));
    parameters.lights[0].direction = {0, -0.8F, -0.6F};
    model.images.panorama = coloured_panorama();
    return model;
}

inline Camera look_from(glm::dvec3 position, glm::dvec3 at, double angle = 1.0) {
    Camera camera;
    camera.position = position;
    camera.focal_point = at;
    const glm::dvec3 d = glm::normalize(at - position);
    camera.up = std::abs(d.y) > 0.99 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
    camera.view_angle = angle;
    return camera;
}

inline std::shared_ptr<const Surroundings> surroundings_of(const Model &model) {
    return std::make_shared<const Surroundings>(model.parameters, TiledImages::of(model.images));
}

inline Framebuffer reference_picture(const Model &model, const Camera &camera, const RenderOptions &options,
                                     int width = 160, int height = 120) {
    Framebuffer target(width, height);
    ReferenceRenderer(model, surroundings_of(model)).render(camera, options, target);
    return target;
}

// Number of pixels that differ.
inline std::size_t count_changes(const Framebuffer &a, const Framebuffer &b) {
    std::size_t changes = 0;
    for (std::size_t i = 0; i < a.pixels(); ++i)
        changes += static_cast<std::size_t>(a.colour[i] != b.colour[i]);
    return changes;
}

} // namespace pbm::test
