// Estimates the surface of all points of a level in three passes, for the baker.
//
// A voxel's centre lies up to 0.87 voxel edges off the surface, 0.42 on scans (root mean square). The first pass takes
// the mean of the occupied voxels around a point, which lies near the surface. The second pass extends the neighbours'
// estimates along their tangent planes to the point and takes the mean, which leaves an error of 0.08 to 0.14 voxels.
// The third pass finds the outermost of the layers that registered scans form around a point.
//
// SurfaceOffsets is the estimate of the renderers. On two scans (0.2 and 3.3 million points) the two differ by 0.12
// voxel edges (root mean square), and by more than 0.25 at 4 % of the points. On one core this one takes 0.3 to 0.9
// microseconds per point, SurfaceOffsets 0.02 to 0.06.
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
    std::uint64_t first_point = 0;         // the brick's points end where the next brick's start
};

// Centre of the voxel at a place (Morton code) of a brick, in voxels from the grid's minimum corner.
inline std::array<double, 3> voxel_centre(const LevelBrick &brick, std::uint16_t place) {
    const auto local = morton_decode(place);
    std::array<double, 3> centre{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        centre[axis] = 8.0 * brick.corner[axis] + local[axis] + 0.5;
    return centre;
}

struct LevelPoints {
    int level;                              // the grid has 2^level voxels per edge
    std::span<const LevelBrick> bricks;     // in Morton order; a sentinel at the end has first_point = number of points
    std::span<const std::uint16_t> places;  // [points]: Morton code of 9 bits within the brick, ascending in each
    std::span<const std::uint16_t> normals; // [points]: normal index | kTwoSidedBit
    ByteView radii;                         // [points]: index into the radius table
};

// Steps of a stored distance per voxel edge.
inline constexpr int kCarriedSteps = 128;
// A surface at most this many voxel edges above that of a point, of the same side, is a layer of the same surface.
inline constexpr float kMaxLayer = 1.5F;

// Distances along the normals of points, in 1 / kCarriedSteps voxel edges.
struct CarriedOffsets {
    std::vector<std::int8_t> surface; // [points] from the voxel's centre to the surface
    // [points] from there to the outermost layer above it, at most kMaxLayer; small on a single surface, where it is
    // the difference of neighbours' estimates; 0 for two-sided points, whose outer side is unknown.
    std::vector<std::uint8_t> layers;
};
CarriedOffsets carried_offsets(const LevelPoints &points, int threads);

} // namespace pbm
