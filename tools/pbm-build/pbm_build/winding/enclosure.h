// Whether points lie inside closed surfaces.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <span>
#include <vector>

namespace pbm::build {

// How often some faces, which bound volumes, wind around each of `points`; 0: it lies outside. `signs`: of each face 0:
// it does not count; -1: it is wound inwards. Counts where the ray from the point along +x leaves and enters a volume;
// it takes longer where many faces lie beside many points.
std::vector<int> winding_numbers(const Surface &surface, std::span<const std::int8_t> signs,
                                 std::span<const glm::dvec3> points);

} // namespace pbm::build
