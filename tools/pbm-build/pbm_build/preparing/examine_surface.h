// Verifies an input before it is built, and reports what was dropped or looks wrong.
#pragma once

#include "pbm_build/grid/grid_choice.h"
#include "pbm_build/report/build_statistics.h"
#include "pbm_scan/surface/surface.h"

#include <span>
#include <string>

namespace pbm::build {

// Moves the report of one input to `statistics`, adds the input to the counts, and reports the vertices and triangles
// that the reader dropped.
void take_report(Surface &surface, BuildStatistics &statistics);

// Reports vertices without a face.
//
// errors  bad_input            no points, or no face is left; with `strict`: vertices that no triangle uses
//         unsupported_feature  more than kMaxMaterials materials
Status examine_surface(const Surface &surface, bool strict, BuildStatistics &statistics);

// An input whose coordinates are all in single precision: its resolution is `step`.
struct SinglePrecision {
    std::string input;
    double step, near; // model units; `near`: the largest coordinate, where `step` holds
};

// Reports the inputs whose resolution is coarser than a voxel.
void report_steps(std::span<const SinglePrecision> inputs, double voxel_size, BuildStatistics &statistics);

// Reports when the precision of the coordinates, not the sampling of the scan, determines the size of the voxels.
void report_precision(const Bounds &bounds, const Grid &grid, BuildStatistics &statistics);

} // namespace pbm::build
