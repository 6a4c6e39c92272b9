// Estimates where in its voxel the surface lies, for all points of a level, with two passes: the estimate of the baker.
//
// A voxel's centre lies up to 0.87 voxel edges off the surface, 0.42 on scans (root mean square). The mean of the
// occupied voxels around a point lies near the surface; that is the first pass. Tangent planes then carry the
// estimates of the points around to each point, and the second pass takes their mean. It leaves 0.08 to 0.14 voxels.
//
// SurfaceOffsets, the estimate of the renderers, is another one: see there. On two scans (0.2 and 3.3 million points)
// the two differ by 0.12 voxel edges (root mean square), and by more than 0.25 at 4 % of the points. On one core this
// one takes 0.6 to 0.9 microseconds per point, SurfaceOffsets 0.02 to 0.06.
#pragma once

#include "pbm_format/model/octree.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// Up to 512 points in 8x8x8 voxels of one level.
struct LevelBrick {
    std::array<std::uint16_t, 3> corner{}; // its first voxel / 8
    std::uint64_t first_point = 0;         // the last one ends where the next brick starts
};

struct LevelPoints {
    int level;                              // the grid has 2^level voxels per edge
    std::span<const LevelBrick> bricks;     // in Morton order, and one more whose first point is behind the last one
    std::span<const std::uint16_t> places;  // [points]: Morton code of 9 bits within the brick
    std::span<const std::uint16_t> normals; // [points]: normal index | kTwoSidedBit
};

// Of a stored offset per voxel edge.
inline constexpr int kCarriedSteps = 128;

// For each point the way from the voxel's centre along the normal to the surface, in kCarriedSteps-ths of a voxel edge.
std::vector<std::int8_t> carried_offsets(const LevelPoints &points, int threads);

} // namespace pbm
