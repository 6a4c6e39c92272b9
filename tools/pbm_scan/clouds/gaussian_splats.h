// Gaussian splats as points: the disc that a splat nearly is, in its mean colour.
// Based on: Kerbl, Kopanas, Leimkuehler, Drettakis. 3D Gaussian splatting for real-time radiance field rendering. 2023
#pragma once

#include "pbm_scan/surface/surface.h"

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

namespace pbm::build {

// What a file says of its splats beside their centres. Each array is [splats].
struct GaussianSplats {
    std::vector<glm::vec3> scales;    // standard deviations along the three axes of the splat, model units
    std::vector<glm::quat> rotations; // of these axes, of any length
    std::vector<float> opacities;     // 0..1; empty: all are opaque
};

// A point that takes the place of a splat.
struct SplatDisc {
    glm::vec3 normal; // along the shortest axis, of either sign; zero where the file gives no shape
    float radius;     // geometric mean of the deviations along the two other axes; 0 where the file gives no shape
};
SplatDisc disc_of(const glm::vec3 &scale, const glm::quat &rotation);

// sRGB of the constant spherical harmonic's coefficients, as the mean over all directions.
Rgb8 splat_colour(const glm::vec3 &coefficients);

// e to the power of a number of a file, which holds logarithms. In double precision, so that libraries and processors
// agree on the float.
inline float exponential(float logarithm) { return static_cast<float>(std::exp(static_cast<double>(logarithm))); }

// Gaussian splats in PLY have x to the right, y downwards, z forwards, as the method's own program writes them. Turns
// positions and normals by half a turn about x, so that y points upwards as in SPZ.
void turn_upright(Surface &surface);

// Whether a splat is left out because it is nearly transparent. NaN is.
inline bool is_faint(float opacity, const ReadOptions &options) {
    return !(static_cast<double>(opacity) >= options.min_opacity);
}
Error all_splats_are_faint(const ReadOptions &options);
// The line about splats that are left out.
AttributeReport faint_splats_report(std::size_t faint, std::size_t all, const ReadOptions &options);

// Gives the points of `surface`, one for each splat, normals, radii and both sides; removes faint ones.
//
// errors  bad_input  all are faint
Status show_discs(Surface &surface, const GaussianSplats &splats, const ReadOptions &options);

// For reports.
inline constexpr const char *kSplatColourNote = "a Gaussian splat's mean colour to sRGB of 8 bits";
inline constexpr const char *kSplatShapeNote = "of Gaussian splats, to discs: normals and radii";
inline constexpr const char *kSplatHarmonicsNote = "how a Gaussian splat's colour depends on the direction";

} // namespace pbm::build
