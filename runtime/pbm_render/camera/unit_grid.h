// Renderers draw in a cube of edge 1 at the origin. So floats suffice, and the picture does not depend on the scan's
// unit or position.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/camera.h"

namespace pbm {

Grid unit_grid(const Grid &grid);
// The camera that sees the unit grid as `camera` sees `grid`.
Camera in_unit_grid(const Camera &camera, const Grid &grid);

} // namespace pbm
