// Roughness and metal of physically based materials as coefficients of Phong's reflection.
// Based on: Khronos Group. glTF 2.0 Specification. 2021 (section 3.9.2, appendix B)
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <array>
#include <cstdint>

namespace pbm::build {

// Sets coefficient and exponent of the reflection of lights, and the share of a panorama's reflection and its tint. A
// metal reflects more, and in its colour; what is rough reflects less, and wider.
void set_reflectance(const Reflectance &reflectance, Material &material);

// What is no metal and has coefficient and exponent of `material`, or comes near to them.
Reflectance reflectance_of(const Material &material);

// A reflection of `specular` (0..1, linear; of most surfaces 0.04) that is as sharp as `gloss`, 0..1.
Reflectance reflectance_of(double specular, double gloss);

// A texel of images of `reflectance`, without its opacity.
using ReflectanceTexel = std::array<std::uint8_t, 3>;
ReflectanceTexel texel_of(const Reflectance &reflectance);

// What an image says of a reflection, beside others.
enum class ReflectancePart : std::uint8_t {
    roughness_metal, // green is roughness, blue is metal
    roughness,       // brightness
    metal,           // brightness
    specular,        // opacity: a factor of specular
    specular_colour, // sRGB: its strongest channel is a factor of specular
};

// Sets what a texel of such an image says in one of `specular_roughness_metal`. `colour`: linear factors of the
// channels of `specular_colour`, 0..1.
void set_part(ReflectancePart part, const std::array<float, 3> &colour, const std::array<std::uint8_t, 4> &from,
              std::array<std::uint8_t, 4> &texel);

// Makes `image`, whose content is `roughness_metal`, `specular_roughness_metal` or `specular_gloss`, one of
// `reflectance`.
void settle_reflectance(Texture &image);

// Multiplies an image of `emission` by its factors; no channel gets brighter than white.
void settle_emission(Texture &image);

// Makes `image`, whose content is `occlusion`, one of `darkness`.
void settle_occlusion(Texture &image);

} // namespace pbm::build
