// Merges several scans into one surface.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <vector>

namespace pbm::build {

// Concatenates triangles and points; welds no vertices. The model built from the result does not depend on the order of
// the surfaces. A single surface is returned unchanged. Otherwise:
//   materials  Equal ones become one, all are sorted. A surface without materials has the default one.
//   colours    A surface without colours takes those of its materials, if another surface has colours.
//   normals    A surface without normals gets those of its faces (vertex_normals.h), with flat facets also where
//              others are smooth (creases.h). Faces whose winding disagrees with
//              the given normals are reversed.
//   radii      A surface without radii gets computed ones (splat_radius.h).
//   stations   All are kept. A surface without stations has none.
// The report names what was added to each surface.
//
// errors  unsupported_feature  more than kMaxMaterials different materials
//         too_large            more vertices than 32 bits can number
Result<Surface> merge_surfaces(std::vector<Surface> surfaces, int threads);

} // namespace pbm::build
