// Bounds of bricks on the screen: what their splats can cover at most.
#pragma once

#include "pbm_render/bricks/brick_culling.h"

#include <span>

namespace pbm {

// Narrows rows and columns of the bricks, and bounds the depths of their pixels, as splats are drawn: as blocks or as
// ellipses, see VisibleBrick::block.
void bound_bricks(const FrameGeometry &frame, const RunGeometry &run, std::span<VisibleBrick> bricks);

} // namespace pbm
