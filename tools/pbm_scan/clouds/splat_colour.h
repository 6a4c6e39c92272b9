// The colour of a Gaussian splat that is shown as a point.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <glm/vec3.hpp>

namespace pbm::build {

// sRGB of the constant spherical harmonic's coefficients, as the mean over all directions.
// Based on: Kerbl, Kopanas, Leimkuehler, Drettakis. 3D Gaussian splatting for real-time radiance field rendering. 2023
inline Rgb8 splat_colour(const glm::vec3 &coefficients) {
    constexpr float kConstantHarmonic = 0.28209479F; // 1 / (2 sqrt(pi))
    return colour_bytes(0.5F + coefficients * kConstantHarmonic, 255.0F);
}

inline constexpr const char *kSplatColourNote = "a Gaussian splat's mean colour to sRGB of 8 bits";
inline constexpr const char *kSplatShapeNote = "a Gaussian splat's parameters; PBM shows points";

} // namespace pbm::build
