// Points of several bricks that face the eye, or of which the eye sees the backs, in screen space.
#pragma once

#include "pbm_render/splats/near_splat.h"
#include "pbm_surface/brick_points.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pbm {

// Points that are collected before they are drawn.
inline constexpr std::size_t kWaiting = 512;

// Contiguous, so that SIMD vectors are full although bricks differ in size.
struct FacingPoints {
    static constexpr std::size_t kCapacity = kWaiting + kBrickPoints + kMaxLanes;
    std::size_t count = 0;
    bool are_backs = false;                                 // all of them face away
    std::vector<NearSplat> near;                            // those around the eye; the arrays hold the others
    alignas(64) std::array<float, kCapacity> x, y, w;       // pixel and depth
    alignas(64) std::array<std::int32_t, kCapacity> normal; // packed; bit 0 is set for two-sided points
    alignas(64) std::array<std::int32_t, kCapacity> id;
    // Only for placed splats:
    alignas(64) std::array<float, kCapacity> offset; // voxel edges
    // For blocks of 3 x 3 pixels and ellipses:
    alignas(64) std::array<float, kCapacity> radius; // grid edges
    // Only for ellipses:
    alignas(64) std::array<std::int32_t, kCapacity> normal_index;

    // Copies a point of those for ellipses.
    void move(std::size_t from, std::size_t to) {
        for (auto *const of : {&x, &y, &w, &offset, &radius})
            (*of)[to] = (*of)[from];
        for (auto *const of : {&normal, &id, &normal_index})
            (*of)[to] = (*of)[from];
    }
};

} // namespace pbm
