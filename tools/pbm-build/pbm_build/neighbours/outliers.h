// Points far from all others: dust, reflections, matching errors of a scan.
// Based on: Breunig, Kriegel, Ng, Sander. LOF: Identifying Density-Based Local Outliers. 2000 (density compared with
// that
//           of the neighbours, so that sparse regions of a scan are no outliers)
#pragma once

#include "pbm_build/neighbours/neighbours.h"
#include "system/bytes.h"

namespace pbm::build {

inline constexpr std::size_t kSpacingNeighbours = 8;

// The spacing of a point is the mean distance to its nearest kSpacingNeighbours. It is an outlier if that is more than
// kOutlierFactor times the median of theirs, and more than kOutlierFactor times the median of the cloud.
inline constexpr double kOutlierFactor = 4;

// The median of a cloud is that of so many of its points at least, evenly taken in their order.
inline constexpr std::size_t kSpacingSample = 4096;

// [points] 1: an outlier. Only points that may be one are searched for their neighbours: those whose neighbours along
// the Morton curve are near enough have a small spacing.
Bytes find_outliers(const PointNeighbours &neighbours, int threads);

} // namespace pbm::build
