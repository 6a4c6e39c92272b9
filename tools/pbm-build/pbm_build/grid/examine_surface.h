// What there is to say about an input before it is built, and what refuses it.
#pragma once

#include "pbm_build/grid/grid_choice.h"
#include "pbm_build/report/build_statistics.h"
#include "pbm_scan/surface/surface.h"

#include <span>
#include <string>

namespace pbm::build {

// Counts one input, moves its report into `statistics` under its name, turns its faces if that is asked for, and says
// what the readers left out, what belongs to no face and what seems to be wound inwards.
//
// errors  bad_input            no points, or no face is left; with `strict`: vertices that no triangle uses
//         unsupported_feature  more than kMaxMaterials materials
Status examine_surface(Surface &surface, bool flip_faces, bool strict, BuildStatistics &statistics);

// An input whose coordinates are numbers of single precision: they cannot tell places apart that lie closer than
// `step`.
struct SinglePrecision {
    std::string input;
    double step, near; // model units; the coordinate at which that is so
};

// Says which inputs have steps longer than a voxel.
void report_steps(std::span<const SinglePrecision> inputs, double voxel_size, BuildStatistics &statistics);

// Says where the precision of the coordinates, not the scan, sets the size of the voxels.
void report_precision(const Bounds &bounds, const Grid &grid, BuildStatistics &statistics);

} // namespace pbm::build
