// Roughness and metal of physically based materials as coefficients of Phong's reflection.
// Based on: Khronos Group. glTF 2.0 Specification. 2021 (section 3.9.2, appendix B)
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>

namespace pbm::build {

// Sets coefficient and exponent of the reflection of lights, and the share of a panorama's reflection. A metal reflects
// more; what is rough reflects less, and wider.
void set_reflectance(const Reflectance &reflectance, Material &material);

// A reflection of `specular` (0..1, linear; of most surfaces 0.04) that is as sharp as `gloss`, 0..1.
Reflectance reflectance_of(double specular, double gloss);

// A texel of images of `reflectance`, without its opacity.
using ReflectanceTexel = std::array<std::uint8_t, 3>;
ReflectanceTexel texel_of(const Reflectance &reflectance);

// Makes `image`, whose content is `roughness_metal` or `specular_gloss`, one of `reflectance`.
void settle_reflectance(Texture &image);

// Multiplies the metal of an image of `reflectance` by the brightest channel of the surface's colour, since a metal
// reflects in its colour: `factor`, linear, times the image of colours that lies on the same places, or null.
void darken_metal(Texture &image, const Texture *colours, const glm::vec3 &factor);

} // namespace pbm::build
