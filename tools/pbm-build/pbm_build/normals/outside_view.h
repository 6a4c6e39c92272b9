// Determines which side of a cloud of points faces outwards, from its visibility from all around.
// Based on: Katz, Tal, Basri. Direct Visibility of Point Sets. 2007 (the question; here answered by depth maps)
#pragma once

#include "pbm_build/lattice/lattice.h"
#include "pbm_build/surface/short_normal.h"

namespace pbm::build {

struct OutsideView {
    std::vector<std::int32_t>
        towards;                    // [points] sum of -cosine(sight, normal) x 2^15 over the views that see the point
    std::vector<std::int32_t> seen; // [points] sum of the absolute values; 0: hidden from everywhere
};

// Views the cloud from 26 directions. `spacing`: distance between points in lattice steps, > 0. Points within a few
// spacings in depth count as one surface.
OutsideView view_from_outside(const std::vector<LatticePoint> &points, const std::vector<ShortNormal> &normals,
                              double spacing, int threads);

// Whether the points are those of a body's surface: few are hidden from everywhere, as within a crown, and each is seen
// from one side, as a sheet is not.
bool looks_like_body(const OutsideView &view);

} // namespace pbm::build
