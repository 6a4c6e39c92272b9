// Points of several bricks that face the eye, in screen space.
#pragma once

#include "pbm_surface/brick_points.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace pbm {

// Points that are collected before they are drawn.
inline constexpr std::size_t kWaiting = 512;

// Contiguous, so that SIMD vectors are full although bricks differ in size.
struct FacingPoints {
    static constexpr std::size_t kCapacity = kWaiting + kBrickPoints + kMaxLanes;
    std::size_t count = 0;
    alignas(64) std::array<float, kCapacity> x, y, w;       // pixel and depth
    alignas(64) std::array<std::int32_t, kCapacity> normal; // packed; bit 0 is set for two-sided points
    alignas(64) std::array<std::int32_t, kCapacity> id;
    // Only for placed splats:
    alignas(64) std::array<float, kCapacity> offset; // voxel edges
    // For blocks of 3 x 3 pixels and ellipses:
    alignas(64) std::array<float, kCapacity> radius; // grid edges
    // Only for ellipses:
    alignas(64) std::array<std::int32_t, kCapacity> normal_index;
};

} // namespace pbm
