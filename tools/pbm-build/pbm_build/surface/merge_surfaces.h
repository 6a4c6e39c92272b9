// Several scans become one surface.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <vector>

namespace pbm::build {

// Triangles and points side by side, on nothing but their coordinates: no vertices are welded. What is built of the
// result does not depend on the order of the surfaces. One surface is returned as it is. Of several,
//   materials  that are equal become one; all are sorted. A surface without any has the default material.
//   colours    of a surface without any are those of its materials, where another surface has colours.
//   normals    where a surface has none its vertices get those of its faces (vertex_normals.h); where those that it has
//              disagree with the winding of its faces, the faces are turned.
//   radii      where a surface has none they are chosen (splat_radius.h).
// Lines of the report say what was added to which surface.
//
// errors  unsupported_feature  more than kMaxMaterials different materials
//         too_large            more vertices than 32 bits can number
Result<Surface> merge_surfaces(std::vector<Surface> surfaces, int threads);

} // namespace pbm::build
