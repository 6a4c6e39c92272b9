// A brick of 8x8x8 voxels and one voxel around it, of the 26 bricks beside it: for what asks the neighbours of each
// voxel.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace pbm {

inline constexpr int kBrickEdge = 8, kPaddedEdge = kBrickEdge + 2;
inline constexpr int kPaddedSlice = kPaddedEdge * kPaddedEdge, kPaddedVoxels = kPaddedSlice * kPaddedEdge;

// The brick itself among the 27, which are counted x fastest.
inline constexpr int kMiddleBrick = 13;

// Index x + 10 y + 100 z in a padded brick of a place (Morton code) of each of the 27, or -1 if it lies further than
// one voxel off. [27][512]
const std::vector<std::array<std::int16_t, 512>> &padded_places();

} // namespace pbm
