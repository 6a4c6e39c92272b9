// What is worked out for points without faces before they are put on a grid: which are outliers, and the normals of
// those that have none.
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
    UpAxis up = UpAxis::y; // the side to which open sheets are turned
};

// Of the vertices (vertex_normals.h) and points of a surface. Points lose their outliers if asked to; those without a
// normal get one, and become two-sided where its sign is not known. Given normals of points are kept and lend their
// sign to estimated ones. The same for any number of threads and any order of the points. Says in `statistics` what was
// found and done. At most 2^31 points.
VertexNormals estimate_normals(Surface &surface, const PointRequest &request, int threads, BuildStatistics &statistics);

} // namespace pbm::build
