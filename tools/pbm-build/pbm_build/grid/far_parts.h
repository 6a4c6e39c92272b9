// Parts of a surface so far from the rest that with them the model would be a dot: stray points, vertices and faces.
#pragma once

#include "pbm_build/report/build_statistics.h"
#include "pbm_scan/surface/surface.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace pbm::build {

// A grid that is so many times larger takes three levels from the model and shows it as a dot.
inline constexpr double kStrayFactor = 10;

// Parts with more than 1 / kStrayShare of all vertices and points, or of the area, are objects, not strays.
inline constexpr std::size_t kStrayShare = 20;

// A few vertices that make the grid so many times larger are damage, whatever their faces.
inline constexpr double kDamageFactor = 1000;

// [axis][bin]: how many points lie in each of kBoxBins equal parts of the box around all points.
inline constexpr std::size_t kBoxBins = 1024;
using BoxBins = std::array<std::array<std::uint64_t, kBoxBins>, 3>;

// Whether, along each axis, all points but `few` at each end lie within 1 / kStrayFactor of the box. Needs more than
// 2 `few` points.
bool bulk_is_small(const BoxBins &counts, std::uint64_t few);

// Drops the far parts of a surface: vertices with their faces, and points. Distances are the longest component of the
// difference to the median of all coordinates. A part is far if
//   - between it and the rest lies an empty shell, whose outer radius is twice the inner one;
//   - the rest holds all but 1 / kStrayShare of the vertices and points;
//   - the box of all is at least kStrayFactor times as long as that of the rest.
// Far vertices that make the grid less than kDamageFactor times larger stay if they may be a ground plane or a
// landscape: if faces among them have more than 1 / kStrayShare of the area of the rest, or if one of the faces that
// connect them with the rest has no edge shorter than the box of the rest (a spike to a stray vertex has one).
// Reports what is dropped, and far parts that stay. The order of vertices and faces does not matter.
//
// errors  bad_input  with `strict`: something would be dropped
Status drop_far_parts(Surface &surface, bool strict, BuildStatistics &statistics);

} // namespace pbm::build
