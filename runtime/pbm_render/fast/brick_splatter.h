// Draws the points of bricks as splats into one strip of the picture. This loop takes most of a frame's time. It
// handles the points of a brick in SIMD lanes, with the best target of the processor (Highway); all targets draw the
// same pixels.
#pragma once

#include "pbm_render/fast/strip_bricks.h"
#include "pbm_render/fast/waiting_backs.h"
#include "pbm_render/splats/depth_strip.h"
#include "pbm_render/splats/farthest_depths.h"

#include <cstdint>

namespace pbm {

// Scratch memory for one strip: the points that face away wait here until all front-facing points are drawn.
struct BackScratch {
    WaitingBacks waiting;
    FarthestDepths farthest;
};

// Draws the bricks in the given order, and skips bricks that lie behind the depths drawn so far. Returns the number of
// points drawn; a point that covers several strips is counted in one of them. `backs` is scratch memory, which a thread
// reuses for its strips. Accesses stay in bounds for any bytes of a mapped chunk, since another process may change
// them.
std::uint64_t draw_bricks(const FrameGeometry &frame, const StripBricks &bricks, DepthStrip &strip, BackScratch &backs);

} // namespace pbm
