// The true picture of a model: its mesh, ray traced with the same camera, lights and materials.
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

// All referenced objects must outlive the users of the scene.
struct TracedScene {
    const RayCaster &rays;
    const TriangleMesh &mesh;
    const SurfaceLook &look;
    std::span<const Material> materials;
    std::span<const Light> lights;
    glm::dvec3 light_origin{0};  // model space: origin of the positions of lights
    double edge = 1;             // edge of the model's cube, model units; the scale for rounding errors
    bool shows_backs = false;    // backs are lit like fronts; else they are dark where the light comes from the eye
    int shadowed = 0;            // the first `shadowed` lights cast shadows
    Rgb8 background{51, 51, 51}; // sRGB
};

// Linear light from a hit towards the eye: surface colour * (ambient + sum over the lights). `direction`: that of the
// ray, of any length.
glm::dvec3 reflected_light(const TracedScene &scene, const glm::dvec3 &eye, const glm::dvec3 &direction,
                           const RayHit &hit);

// [height][width], top row first: `samples` rays per pixel, clamped to 0..1 and averaged in linear light. A single
// ray passes through the centre of the pixel; several are spread evenly over it.
std::vector<Srgb> trace(const TracedScene &scene, const Camera &camera, int width, int height, int samples,
                        int threads);

} // namespace pbm
