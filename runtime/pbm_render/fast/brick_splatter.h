// Draws the points of bricks into a strip of the picture. A frame spends most of its time in this loop. It runs in SIMD
// over the points of a brick (Highway, the best target of the machine) and draws the same pixels on every target.
#pragma once

#include "pbm_render/splats/depth_strip.h"

#include <cstdint>
#include <span>

namespace pbm {

// Draws those of the run's `seen` bricks that touch the strip. The id of point i of the chunk is `first_id` + i.
// Returns how many points were drawn; one strip counts each point. Stays in bounds whatever the bytes of a mapped chunk
// became.
std::uint64_t draw_bricks(const FrameGeometry &frame, const RunGeometry &run, std::span<const SeenBrick> seen,
                          std::uint32_t first_id, DepthStrip &strip);

} // namespace pbm
