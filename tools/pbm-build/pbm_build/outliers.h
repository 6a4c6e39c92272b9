// Points far from all others: dust, reflections, matching errors of a scan.
// Based on: Breunig, Kriegel, Ng, Sander. LOF: Identifying Density-Based Local Outliers. 2000 (density compared with
// that
//           of the neighbours, so that sparse regions of a scan are no outliers)
#pragma once

#include "pbm_build/fit_planes.h"

namespace pbm::build {

// A point is an outlier if the mean distance to its nearest kLinks points is more than kOutlierFactor times the median
// of theirs, and more than kOutlierFactor times the median of all.
inline constexpr double kOutlierFactor = 4;

// [points] 1: an outlier.
Bytes find_outliers(const PointLinks &links, int threads);

} // namespace pbm::build
