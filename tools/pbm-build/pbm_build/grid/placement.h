// From the coordinates of a scan to those of its model: scale and shift, in double precision.
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

// Coordinates and radii; positions that were finite may become infinite, which check_bounds (grid_choice.h) refuses.
// Fills float_step and float_near.
void place(Surface &surface, const Placement &placement);

} // namespace pbm::build
