// Images of relief as normal maps.
// Based on: Blinn. Simulation of Wrinkled Surfaces. 1978
#pragma once

#include "pbm_scan/surface/surface.h"

namespace pbm::build {

// White lies so much of the image's width above black.
inline constexpr double kBumpHeight = 0.02;

// Whether a map holds normals in the space of the object: more than an eighth of its texels are unit vectors that point
// into the surface. Neither glTF nor MTL has such maps, but some programs write them.
bool is_of_object(const Texture &image);

// Makes `image`, whose content is `normals` or `relief`, a normal map whose green points upwards. Grey relief holds
// heights, which become the normals of the surface that they describe; coloured relief holds normals. Returns whether
// the image held heights.
bool settle_normals(Texture &image);

} // namespace pbm::build
