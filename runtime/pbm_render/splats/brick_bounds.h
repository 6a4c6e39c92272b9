// Screen-space bounds of bricks: the rows, columns and depths that the splats of a brick can cover.
#pragma once

#include "pbm_render/bricks/brick_culling.h"

#include <span>

namespace pbm {

// Narrows the rows and columns of each brick, in pixels, to those that its splats can cover, and sets the least and the
// greatest depth of these pixels. VisibleBrick::block says whether the splats of a brick are drawn as square blocks of
// pixels or as ellipses; the bounds hold for that form.
void bound_bricks(const FrameGeometry &frame, const RunGeometry &run, std::span<VisibleBrick> bricks);

} // namespace pbm
