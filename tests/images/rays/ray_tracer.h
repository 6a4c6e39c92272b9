// The picture that a model should give: its mesh, ray traced with the same camera, lights and materials.
// Based on: Whitted. An Improved Illumination Model for Shaded Display. 1980; Phong 1975
#pragma once

#include "pbm_format/model/model.h"
#include "ray_caster.h"
#include "surface_look.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

using Srgb = std::array<std::uint8_t, 3>; // R, G, B

// All must outlive who uses it.
struct TracedScene {
    const RayCaster &rays;
    const TriangleMesh &mesh;
    const SurfaceLook &look;
    std::span<const Material> materials;
    std::span<const Light> lights;
    glm::dvec3 light_origin{0};  // model space: what positions of lights count from
    double edge = 1;             // model units, of the model's cube: what is tiny beside it is a rounding error
    int shadowed = 0;            // so many lights, the first ones, reach only what they see
    Rgb8 background{51, 51, 51}; // sRGB
};

// Light that leaves a hit towards the eye, linear: the colour of the surface times (ambient + what every light adds).
// `direction` is the ray's, of any length.
glm::dvec3 reflected_light(const TracedScene &scene, const glm::dvec3 &eye, const glm::dvec3 &direction,
                           const RayHit &hit);

// [height][width], top row first: `samples` rays per pixel, averaged in linear light after
// clamping to 0..1. One is through the pixel's centre, several are spread evenly over the pixel.
std::vector<Srgb> trace(const TracedScene &scene, const Camera &camera, int width, int height, int samples,
                        int threads);

} // namespace pbm
