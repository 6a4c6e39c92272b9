// A brick and its 26 neighbours: directions between them, and array layouts of a brick with the voxels around it. Both
// estimates of the surface visit the 27 voxels around a point, across the borders of bricks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace pbm {

inline constexpr int kBrickEdge = 8; // voxels

// Directions from a brick to its neighbours and to itself (kNoDirection), x fastest.
inline constexpr std::size_t kDirectionCount = 27, kNoDirection = 13;
constexpr std::size_t opposite(std::size_t direction) { return kDirectionCount - 1 - direction; }
// Steps of -1, 0 or 1 along each axis.
constexpr std::array<int, 3> steps_of(std::size_t direction) {
    const int i = static_cast<int>(direction);
    return {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
}

// Whether a cell of a cube with last + 1 cells per edge touches the side, edge or corner that the direction leads to.
constexpr bool touches(const std::array<std::uint32_t, 3> &cell, std::uint32_t last, std::size_t direction) {
    bool all = true;
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (const int step = steps_of(direction)[axis]; step != 0)
            all &= cell[axis] == (step < 0 ? 0 : last);
    return all;
}

// Array layout of a brick and voxels around it: voxel (x, y, z) of the brick is element first + x + y row + z slice.
struct PaddedLayout {
    int row, slice, first;

    constexpr int index(const std::array<std::uint32_t, 3> &voxel) const {
        return first + static_cast<int>(voxel[0]) + static_cast<int>(voxel[1]) * row +
               static_cast<int>(voxel[2]) * slice;
    }
    // Distance between a voxel of the brick and the same voxel of the brick that `direction` leads to.
    constexpr int step(std::size_t direction) const {
        const auto [x, y, z] = steps_of(direction);
        return kBrickEdge * (x + y * row + z * slice);
    }
};

} // namespace pbm
