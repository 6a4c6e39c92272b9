// Converts the votes of shadow maps to the lit fractions of a stream.
#pragma once

#include "pbm_bake/light_view.h"

#include <cstdint>
#include <span>
#include <utility>

namespace pbm {

// Where ray `i` meets a texel of a ground plane, in texels from its corner: a tent filter over [-0.5, 1.5], so that
// shadow edges are smooth between texels.
std::pair<double, double> ray_in_texel(int i);

// Converts the votes of `maps` maps to 0..2^bits - 1, in place. With one bit, half of the maps suffice for lit.
void votes_to_fractions(std::span<std::uint8_t> votes, int maps, int bits);

// Fills in the points of one side that the light does not face, and those behind a spot light. Each gets the mean of
// the smallest node around it (2x2x2 voxels, 4x4x4, ...) that holds a point which the light faces; 0 if there is none.
void fill_unlit(const ShadowCasters &casters, const LightPlace &light, int threads, std::span<std::uint8_t> fractions);

} // namespace pbm
