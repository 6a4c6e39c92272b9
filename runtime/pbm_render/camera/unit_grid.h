// Renderers draw in a cube of edge 1 at the origin: floats suffice, and the scan's unit and position do not matter.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_render/camera/camera.h"

namespace pbm {

Grid unit_grid(const Grid &grid);
// Whether pictures that the camera takes of the model show backs.
bool shows_backs(const Camera &camera, const ModelParameters &parameters);
// The pinhole camera that sees the unit grid as `camera` sees the model's grid. Its `backs` are not automatic.
Camera in_unit_grid(const Camera &camera, const ModelParameters &parameters);

} // namespace pbm
