// Transforms the coordinates of a scan to those of the model: scale and shift, in double precision.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <array>
#include <optional>

namespace pbm::build {

// model = scale x scan + origin
struct Placement {
    std::optional<double> scale;                 // finite, > 0
    std::optional<std::array<double, 3>> origin; // of the scan's coordinates, in the model; finite
};

// Transforms positions, stations and radii; fills float_step and float_near. Positions may become infinite, which
// check_bounds (grid_choice.h) refuses.
void place(Surface &surface, const Placement &placement);

} // namespace pbm::build
