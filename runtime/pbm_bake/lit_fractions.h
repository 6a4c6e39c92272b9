// From votes of shadow maps to the lit fractions of a stream.
#pragma once

#include "pbm_bake/light_view.h"

#include <cstdint>
#include <span>
#include <utility>

namespace pbm {

// Where ray `i` meets a texel of a ground plane, in texels from its corner: a tent one texel beyond its borders, so
// that edges are smooth between texels, too.
std::pair<double, double> ray_in_texel(int i);

// In place: of `maps` maps to 0..2^bits - 1. One bit: lit in half of the maps or more.
void votes_to_fractions(std::span<std::uint8_t> votes, int maps, int bits);

// Gives points that the light does not face, or that lie behind a spot light, the mean of those around them that it
// does: of the 2x2x2 voxels they lie in, or the 4x4x4, and so on; all of them 0 if there are none.
void fill_unlit(const ShadowCasters &casters, const LightPlace &light, int threads, std::span<std::uint8_t> fractions);

} // namespace pbm
