// Which images of a surface cut holes into it.
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_scan/surface/surface.h"
#include "system/error.h"

#include <optional>

namespace pbm::build {

struct HoleRequest {
    std::optional<double> alpha_cutoff{}; // 0..1: less opaque texels of every image are no surface, 0: all are surface;
                                          // absent: as the materials say
    bool strict = false;                  // refuse what would be dropped
};

// Settles TextureUse::least_opacity. An image of a blended material cuts holes if of its texels that triangles show
// some are clear (below 1/8) and others not less opaque than that: leaves, fences. Others are glass, and stay a
// surface. A cutoff that is given asks for no clear ones. Reports both kinds.
//
// errors  bad_input  with `strict`: an opacity would be dropped
Status settle_holes(Surface &surface, const HoleRequest &request, int threads, BuildStatistics &statistics);

} // namespace pbm::build
