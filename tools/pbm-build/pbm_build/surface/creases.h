// Which edges of a surface are creases, where the file declares no normals.
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_scan/surface/surface.h"

#include <optional>

namespace pbm::build {

// An STL file stores its facets apart, so it says of no edge whether it is smooth. Faces of glTF without normals are
// flat by its specification, but exporters of scans leave normals out to save space. Facets of both stay flat if they
// are fewer than so many, or if the surface is constructed (kMinPlanarShare, corner_normals.h).
inline constexpr std::size_t kFewFacets = 5000;

// Sets the surface's crease angle: to the requested one, degrees, which overrules smoothing groups; else to 0 where
// facets stay flat. Reports what became of facets, and a request without effect.
void choose_creases(Surface &surface, std::optional<double> requested, int threads, BuildStatistics &statistics);

// Gives every face corners and a normal of its own: for a surface with flat facets that is merged with others.
void separate_facets(Surface &surface);

} // namespace pbm::build
