// Renderers draw in a cube of edge 1 at the origin: floats suffice, and the scan's unit and position do not matter.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/camera.h"

namespace pbm {

Grid unit_grid(const Grid &grid);
// The pinhole camera that sees the unit grid as `camera` sees `grid`.
Camera in_unit_grid(const Camera &camera, const Grid &grid);

} // namespace pbm
