// Shades the pixels of a row by Phong reflection, each with its own normal and position. SIMD (Highway); the colours
// are the same on every target. Based on: Phong. Illumination for Computer Generated Pictures. 1975
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/camera/transform_table.h"

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
std::vector<EyeLight> see_lights(std::span<const Light> lights, double grid_edge, const Projection &projection);

// The ray through pixel (x, y) is ((x - middle_x), (y - middle_y), focal) / focal, eye space.
struct EyeRays {
    float middle_x, middle_y, inverse_focal;
};

// Turns the colours of a row's pixels into light towards the eye. `screen_y` is the row's counterpart to screen_x. The
// row holds lit fractions of the first `shadowed` lights.
void shade_row(const EyeRays &rays, std::span<const EyeLight> lights, std::size_t shadowed, float screen_y,
               SurfaceRow &row);

} // namespace pbm
