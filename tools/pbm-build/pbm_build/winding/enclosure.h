// Whether points lie inside closed surfaces.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <span>
#include <vector>

namespace pbm::build {

// [points]: how often closed surfaces wind around each of `points`; 0: the point lies outside. `signs` [triangles]: 1
// for a face that is wound outwards, -1 for one that is wound inwards, 0 for one that does not count. Counts how often
// the ray from the point along +x leaves and enters a volume. The time grows with the number of pairs of a point and a
// face at one y.
std::vector<int> winding_numbers(const Surface &surface, std::span<const std::int8_t> signs,
                                 std::span<const glm::dvec3> points);

} // namespace pbm::build
