// Scans in the order of their lines of sight as triangles, where these hold most of their points.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <cstdint>
#include <vector>

namespace pbm::build {

// The lines of sight of a scan: `cells` as triangulate_range_grid takes them. No columns: there is no such grid.
struct ScanGrid {
    std::vector<std::uint32_t> cells;
    std::size_t columns = 0;
};

// Minimum share of the positions that triangles must hold. The others are points beside them (surface.h), as floors are
// where a scanner looks along them.
constexpr double kMinTriangulatedShare = 0.5;

// Fills surface.triangles from the grids of all of its scans, or of none of them, and turns them towards the stations.
// Scans without a station stay points: a grid that no scanner made (tables of points from the air) has no neighbours.
// Changes the order of the positions. `surface` has no triangles before, and a position in each cell that is not empty.
// The fate is that of the grid: `converted`, or `dropped` where the scans stay points.
AttributeReport triangulate_scans(Surface &surface, const std::vector<ScanGrid> &grids);

} // namespace pbm::build
