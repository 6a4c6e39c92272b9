// Points far from all others: dust, reflections, matching errors of a scan.
// Based on: Breunig, Kriegel, Ng, Sander. LOF: Identifying Density-Based Local Outliers. 2000 (compares the density at
// a point with that at its neighbours: sparse regions of a scan are no outliers)
#pragma once

#include "pbm_build/neighbours/neighbours.h"
#include "system/bytes.h"

namespace pbm::build {

inline constexpr std::size_t kSpacingNeighbours = 8;

// The spacing of a point is the mean distance to its nearest kSpacingNeighbours. It is an outlier if that is more than
// kOutlierFactor times the median of theirs, and more than kOutlierFactor times the median of the cloud.
inline constexpr double kOutlierFactor = 4;

// The median of the cloud is estimated from at least so many of its points, evenly spaced along their order.
inline constexpr std::size_t kSpacingSample = 4096;

// [points] 1: an outlier. Neighbours are searched only for points whose neighbours along the Morton curve are far:
// these distances bound the spacing from above.
Bytes find_outliers(const PointNeighbours &neighbours, int threads);

// The same for points whose spacings and `nearest` [points][kSpacingNeighbours] are known.
Bytes find_outliers(std::span<const float> spacings, std::span<const std::uint32_t> nearest);

// The upper median; `values` is not empty.
float median_of(std::vector<float> values);

} // namespace pbm::build
