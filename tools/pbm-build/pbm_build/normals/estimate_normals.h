// Estimates the missing normals of points without faces, and finds or removes their outliers.
#pragma once

#include "pbm_build/grid/far_parts.h"
#include "pbm_build/report/build_statistics.h"
#include "pbm_build/surface/vertex_normals.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <optional>

namespace pbm::build {

// What becomes of outliers (outliers.h) among points without faces, and of far parts (far_parts.h) of any surface.
//   drop_strays  outliers stay, unless they make the grid at least kStrayFactor times larger; far parts are dropped
//   keep         all of them
//   drop         none of them
enum class Outliers { drop_strays, keep, drop };

struct PointRequest {
    std::optional<std::array<double, 3>> viewpoint; // model units: estimated normals face it
    Outliers outliers = Outliers::drop_strays;
    bool strict = false;     // refuse strays
    bool keep_signs = false; // of given normals, also if all point into the object (inward_normals.h)
    UpAxis up = UpAxis::y;   // open sheets are oriented upwards
};

// Normals of the vertices (vertex_normals.h) and points of a surface. Drops outliers of the points as requested. A
// point without a normal gets an estimated one, and becomes two-sided if its sign is unknown. Given normals of points
// are kept, and determine the signs of estimated ones; if all points have them and all point into an object, they are
// turned. Estimated normals face the viewpoint, else the station of their
// point. The result does not depend on the number of threads or the order of the points. Frees surface.normals.
// Reports to `statistics`. At most 2^31 points.
//
// errors  bad_input  with `strict`: strays
Result<VertexNormals> estimate_normals(Surface &surface, const PointRequest &request, int threads,
                                       BuildStatistics &statistics);

} // namespace pbm::build
