// Which side of a cloud of points faces outwards, judged by what can be seen from around it.
// Based on: Katz, Tal, Basri. Direct Visibility of Point Sets. 2007 (the question; here answered by depth maps)
#pragma once

#include "pbm_build/grid/lattice.h"
#include "pbm_build/surface/short_normal.h"

namespace pbm::build {

struct OutsideView {
    std::vector<std::int32_t> towards; // [points] how far the normals face those who see them, minus how far they don't
    std::vector<std::int32_t> seen;    // [points] the same summed without sign; 0: hidden from everywhere
};

// Looks at the cloud from 26 sides. `spacing`: distance between points in lattice steps, > 0; what lies within a few of
// them counts as one surface.
OutsideView view_from_outside(const std::vector<LatticePoint> &points, const std::vector<ShortNormal> &normals,
                              double spacing, int threads);

} // namespace pbm::build
