// A brick and the 26 beside it: the ways from one to another, and arrays that hold a brick with the voxels around it.
// Both estimates of the surface within a voxel look at the 27 voxels around a point, across the borders of bricks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace pbm {

inline constexpr int kBrickEdge = 8; // voxels

// The ways from a brick to those around it and to itself (kNoWay), counted x fastest.
inline constexpr std::size_t kWays = 27, kNoWay = 13;
constexpr std::size_t opposite(std::size_t way) { return kWays - 1 - way; }
// -1, 0 or 1 along each axis.
constexpr std::array<int, 3> steps_of(std::size_t way) {
    const int i = static_cast<int>(way);
    return {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
}

// Whether a cell of a cube of last + 1 cells per edge lies on the side of the cube that the way leads to.
constexpr bool touches(const std::array<std::uint32_t, 3> &cell, std::uint32_t last, std::size_t way) {
    bool all = true;
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (const int step = steps_of(way)[axis]; step != 0)
            all &= cell[axis] == (step < 0 ? 0 : last);
    return all;
}

// How an array holds a brick and voxels around it: voxel (x, y, z) of the brick is element first + x + y row + z slice.
struct PaddedLayout {
    int row, slice, first;

    constexpr int index(const std::array<std::uint32_t, 3> &voxel) const {
        return first + static_cast<int>(voxel[0]) + static_cast<int>(voxel[1]) * row +
               static_cast<int>(voxel[2]) * slice;
    }
    // From a voxel of the brick to the same voxel of the brick that the way leads to.
    constexpr int step(std::size_t way) const {
        const auto [x, y, z] = steps_of(way);
        return kBrickEdge * (x + y * row + z * slice);
    }
};

} // namespace pbm
