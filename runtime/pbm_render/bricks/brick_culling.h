// Finds the bricks of a run that can be seen, and their rows.
// Based on: Rusinkiewicz, Levoy. QSplat. 2000, section 2 (normal cones); Zhang, Hoff. Fast Backface Culling Using
// Normal Masks. 1997
#pragma once

#include "pbm_render/bricks/frame_geometry.h"
#include "pbm_render/bricks/point_run.h"

#include <span>

namespace pbm {

// A brick whose points may be seen.
struct VisibleBrick {
    float u, v, w;            // M * (centre of its first voxel), see Projection
    std::uint32_t brick;      // index in the chunk
    std::int32_t top, bottom; // its points touch rows top .. bottom - 1 only
    std::int32_t left, right; // and columns left .. right - 1
    float nearest;            // lower bound of the depths of their pixels, grid edges
    bool faces_eye;           // the axis of its normal cone faces the eye; or the eye is near
    bool has_fronts;          // some of its points may face the eye
    bool has_backs;           // some of its points may face away, and backs are shown
    bool faces_away;          // all its points face away, and backs are shown: kFacingSlack does not apply to them
    std::uint8_t block;       // its splats are drawn as blocks of so many pixels each way, 2 or 3; 0: as ellipses
    bool thin;                // splats are so small that redundant points (surface_offsets.h) may be left out
    bool is_cut;              // some of its points may be hidden, or lie outside of the camera's clip region
};

// Values that all bricks of a run share.
struct RunGeometry {
    RunGeometry(const PointRun &points, const FrameGeometry &frame);

    const PointRun *run;
    float voxel;                    // edge, in grid edges
    float max_offset;               // largest distance between a splat's middle and its voxel's centre, grid edges
    std::array<glm::vec3, 3> steps; // M * (d, 0) from a voxel to the next in x, y, z
};

// Splats with a radius up to kBlockRadius * (edge of a block) are drawn as blocks. Their voxels are at most 0.71 block
// edges wide, so that no pixel between the blocks of neighbours stays empty.
inline constexpr float kBlockRadius = 0.675F;

// Writes the visible bricks to `to`, in their order, and returns their number. `to` has room for all bricks of the
// chunk. Their columns are those of the whole picture, and `nearest` is 0, until bound_bricks narrows them. Accesses
// stay in bounds if the bytes of a mapped chunk change.
std::size_t find_visible_bricks(const RunGeometry &run, const FrameGeometry &frame, std::span<VisibleBrick> to);

} // namespace pbm
