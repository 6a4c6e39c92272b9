// Repairs of the faces of a scan, each on request: winding, small parts, holes; and a report of what the faces are
// like.
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_scan/surface/surface.h"

#include <optional>
#include <string>

namespace pbm::build {

struct MeshRequest {
    bool report = false;

    bool any() const { return report; }
};

// Adds the figures and what was done to `statistics`. The result depends on positions and faces alone, not on their
// order, nor on the number of threads. Does nothing to a surface without faces but to report that.
//
// errors  too_large  more than kMaxMeshFaces faces (welded_mesh.h)
Status repair_mesh(Surface &surface, const MeshRequest &request, int threads, BuildStatistics &statistics);

} // namespace pbm::build
