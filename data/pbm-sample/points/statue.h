// A marble statue as a scanner around a turntable would deliver it.
#pragma once

#include "point_scan.h"

namespace pbm::sample {

// Sweeps around the statue (statue_shape.h), from the plinth to the head; cells of nearly equal area (sweeps.h). The
// scanner's noise moves a point along the direction from the line, by up to 1/16 of the spacing and 0.1 mm.
// 1 <= points <= kMaxPoints.
PointScan make_statue(std::uint64_t points, std::uint32_t seed);

} // namespace pbm::sample
