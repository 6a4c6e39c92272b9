// Draws the points of bricks into a strip of the picture: the loop that takes most of a frame. SIMD over the points of
// a brick (Highway, the machine's best target); every target draws the same pixels.
#pragma once

#include "pbm_render/fast/strip_bricks.h"
#include "pbm_render/fast/waiting_backs.h"
#include "pbm_render/splats/depth_strip.h"
#include "pbm_render/splats/farthest_depths.h"

#include <cstdint>

namespace pbm {

// Memory for the backs of a strip.
struct BackScratch {
    WaitingBacks waiting;
    FarthestDepths farthest;
};

// Draws the bricks in their order, but for those that lie behind what is drawn. Returns the points drawn; only one
// strip counts a point. Accesses stay in bounds if the bytes of a mapped chunk change.
std::uint64_t draw_bricks(const FrameGeometry &frame, const StripBricks &bricks, DepthStrip &strip, BackScratch &backs);

} // namespace pbm
