// Draws the points of bricks into a strip of the picture: the loop that a frame's time is spent in. SIMD over the
// points of a brick (Highway, the best target of the machine); the same pixels on every target.
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/bricks/frame_geometry.h"
#include "pbm_render/splats/depth_strip.h"

#include <cstdint>
#include <span>

namespace pbm {

// Draws those of the run's `seen` bricks that touch the strip. The id of point i of the chunk is `first_id` + i.
// Returns how many points were drawn, each counted in one strip. In bounds whatever the bytes of a mapped chunk became.
std::uint64_t draw_bricks(const FrameGeometry &frame, const RunGeometry &run, std::span<const SeenBrick> seen,
                          std::uint32_t first_id, DepthStrip &strip);

} // namespace pbm
