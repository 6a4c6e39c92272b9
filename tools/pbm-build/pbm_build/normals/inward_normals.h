// Given normals of a cloud that look the wrong way.
#pragma once

#include "pbm_build/neighbours/neighbours.h"
#include "pbm_build/surface/short_normal.h"

#include <vector>

namespace pbm::build {

// Whether the cloud is an object whose normals all look inwards: nearly all of its points can be seen from outside, and
// nearly all that can are seen from behind. A room that was scanned from within hides its contents from outside, and
// keeps its normals. `normals`: of the points of `neighbours`. Takes no time if most normals look away from the mean of
// the points.
bool look_inwards(const PointNeighbours &neighbours, const std::vector<ShortNormal> &normals, int threads);

} // namespace pbm::build
