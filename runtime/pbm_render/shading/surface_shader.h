// Shades the pixels of a row by Phong reflection, each with its own normal and position: of blended surfaces, and of
// points whose normals are in a table. SIMD (Highway); the colours are the same on every target.
// Based on: Phong. Illumination for Computer Generated Pictures. 1975
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/camera/projection.h"
#include "pbm_render/picture/framebuffer.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace pbm {

// Pixels of one row that show the surface, from left to right; all arrays are padded for whole SIMD vectors.
struct SurfaceRow {
    explicit SurfaceRow(int width);

    std::size_t count = 0;
    std::vector<std::int32_t> x;
    std::vector<float> screen_x, depth;             // pixels; grid edges
    std::array<std::vector<float>, 3> normal;       // unit, eye space
    std::array<std::vector<float>, 3> colour;       // linear; shade_row turns it into light towards the eye
    std::vector<float> environment;                 // factor
    std::array<std::vector<float>, 3> tint;         // share of the panorama's light that the reflection lacks
    std::array<std::vector<float>, 4> phong;        // ka, kd, ks, power
    std::array<std::vector<float>, kMaxLights> lit; // fractions
};

// A light in eye space: x to the right, y down, z along the view direction; grid edges.
struct EyeLight {
    LightKind kind;
    std::array<float, 3> intensity;
    std::array<float, 3> place;     // position of point and spot lights
    std::array<float, 3> direction; // unit, direction of travel; directional and spot lights
    float exponent;
};
std::vector<EyeLight> lights_in_eye_space(std::span<const Light> lights, double grid_edge,
                                          const Projection &projection);

// The ray through pixel (x, y) is ((x - middle_x), (y - middle_y), focal) / focal, eye space.
struct EyeRays {
    float middle_x, middle_y, inverse_focal;
};

// Turns the colours of a row's pixels into light towards the eye. `screen_y` is the row's counterpart to screen_x. The
// row holds lit fractions of the first `shadowed` lights.
void shade_row(const EyeRays &rays, std::span<const EyeLight> lights, std::size_t shadowed, float screen_y,
               SurfaceRow &row);

// Points that the pixels of one row show, from left to right; all arrays are padded for whole SIMD vectors.
struct PointRow {
    explicit PointRow(int width);

    std::size_t count = 0;
    std::vector<std::uint32_t> colour;              // sRGB, red in the lowest byte
    std::vector<std::uint32_t> normal;              // normal_code
    std::vector<Float4> phong;                      // kd, ks, power, ka
    std::array<std::vector<float>, kMaxLights> lit; // fractions
    std::vector<Float4> mirrored;                   // linear red, green, blue; blending factor
};

// [low 10 bits of a normal's index]: x + 128 y of its integer vector before normalisation, in the positive octant.
using NormalSums = std::array<std::uint16_t, 1024>;
const NormalSums &normal_sums();
// Packs a stored normal into the high 16 bits, and its entry of `sums` into the low 16 bits.
inline std::uint32_t normal_code(std::uint16_t stored, const NormalSums &sums) {
    return (stored & 0x7FFFU) << 16 | sums[stored & 1023]; // without kSideBit
}

// What all points of a frame share.
struct PointLighting {
    EyeRays rays;
    std::array<std::array<float, 3>, 3> axes; // of eye space, in model space
    std::span<const EyeLight> lights;
    bool has_places;      // some of them are point or spot lights
    std::size_t shadowed; // rows hold lit fractions of so many lights
    bool one_material;    // all points of a row have the Phong coefficients of the first one
    bool mirrors;         // rows hold what materials mirror
};
PointLighting make_point_lighting(const EyeRays &rays, const Projection &projection, std::span<const EyeLight> lights);

// The pixels of a row: x ascending, depth in grid edges, padded as the points.
struct PixelPlaces {
    const std::int32_t *x;
    const float *depth;
    float screen_y;
};

// Turns the colours of a row's points into opaque colours of pixels, packed as pack_rgba does. For directional lights
// the eye is infinitely far away.
void shade_points(const PointLighting &lighting, const PixelPlaces &places, PointRow &row);

} // namespace pbm
