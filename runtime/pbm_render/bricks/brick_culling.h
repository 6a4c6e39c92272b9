// Which bricks of a run can be seen, and where. Based on: Rusinkiewicz, Levoy. QSplat. 2000, section 2 (normal cones);
// Zhang, Hoff. Fast Backface Culling Using Normal Masks. 1997
#pragma once

#include "pbm_render/bricks/frame_geometry.h"
#include "pbm_render/bricks/point_run.h"

#include <span>

namespace pbm {

// A brick whose points may be seen.
struct SeenBrick {
    float u, v, w;            // M * (centre of its first voxel), as TransformTable has it
    std::uint32_t brick;      // of the chunk
    std::int32_t top, bottom; // its points touch rows top .. bottom - 1 only
    bool large;               // some splat needs more than a block of 2 x 2 pixels, or the eye is near
};

// What is the same for all bricks of a run.
struct RunGeometry {
    RunGeometry(const PointRun &points, const FrameGeometry &frame);

    const PointRun *run;
    const std::int8_t *offsets = nullptr; // [points of the chunk] if the run has any, once a brick of it is seen
    float voxel;                          // edge, grid edges
    float max_offset;                     // of a splat's middle from the centre of its voxel, grid edges
    std::array<glm::vec3, 3> steps;       // M * (d, 0) from a voxel to the next in x, y, z
};

// Splats up to this radius in pixels are drawn as a block of 2 x 2: points are nearer to each other than that wherever
// voxels are at most 1.42 pixels wide, so that no pixel between them stays empty.
inline constexpr float kBlockRadius = 1.35F;

// Fills `to`, which has room for all bricks of the chunk, in their order; returns how many. In bounds whatever the
// bytes of a mapped chunk became.
std::size_t find_seen_bricks(const RunGeometry &run, const FrameGeometry &frame, std::span<SeenBrick> to);

} // namespace pbm
