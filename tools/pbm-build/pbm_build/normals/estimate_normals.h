// Estimates the missing normals of points without faces, and finds or removes their outliers.
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_build/surface/vertex_normals.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <optional>

namespace pbm::build {

struct PointRequest {
    std::optional<std::array<double, 3>> viewpoint; // model units: estimated normals face it
    bool remove_outliers = false;
    UpAxis up = UpAxis::y; // open sheets are oriented upwards
};

// Normals of the vertices (vertex_normals.h) and points of a surface. Removes the outliers of the points on request. A
// point without a normal gets an estimated one, and becomes two-sided if its sign is unknown. Given normals of points
// are kept, and determine the signs of estimated ones. The result does not depend on the number of threads or the order
// of the points. Reports to `statistics`. At most 2^31 points.
VertexNormals estimate_normals(Surface &surface, const PointRequest &request, int threads, BuildStatistics &statistics);

} // namespace pbm::build
