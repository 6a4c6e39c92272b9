// Draws the points of bricks into a strip of the picture: the loop that takes most of a frame. SIMD over the points of
// a brick (Highway, the machine's best target); every target draws the same pixels.
#pragma once

#include "pbm_render/splats/depth_strip.h"

#include <cstdint>
#include <span>

namespace pbm {

// Draws those of the run's `seen` bricks that touch the strip. Point i of the chunk has the id `first_id` + i. Returns
// the points drawn; only one strip counts a point. Accesses stay in bounds if the bytes of a mapped chunk change.
std::uint64_t draw_bricks(const FrameGeometry &frame, const RunGeometry &run, std::span<const SeenBrick> seen,
                          std::uint32_t first_id, DepthStrip &strip);

} // namespace pbm
