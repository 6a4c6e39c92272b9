// From files to what all parts of a build share: one surface, its normals, its attributes and its grid.
#pragma once

#include "pbm_build/preparing/build_options.h"
#include "pbm_build/report/build_statistics.h"
#include "pbm_build/surface/vertex_normals.h"

#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// The options and the statistics of one build.
struct Run {
    const BuildOptions &options;
    BuildStatistics &statistics;
    StepClock &clock;
};

// The name of an input in errors and reports.
inline std::string name_of(const std::string &input) { return input == "-" ? "standard input" : input; }

// Reads the inputs and moves each to its place in the model.
//
// errors  those of posed_scans and read_surface; the message names the input, where there are several
Result<std::vector<Surface>> read_surfaces(std::span<const std::string> inputs, const Run &run);

// Repairs the surfaces, merges them to one and drops what is too far from it. Moves the lines of their reports to the
// statistics.
//
// errors  bad_input            no point is left; with `strict`: something would be dropped; a denied line
//         unsupported_feature  more than kMaxMaterials materials
Result<Surface> merge_inputs(std::vector<Surface> surfaces, const Run &run);

// What depends on the scan as a whole.
struct Prepared {
    Surface surface;
    Bounds bounds;
    VertexNormals normals;
    AttributeSet set;
    std::vector<Field> fields;
    std::string metadata;
    Grid grid;
};

// Calls merge_inputs, then chooses the up axis, the normals, the attributes and the grid.
//
// errors  those of merge_inputs, choose_fields, make_metadata, estimate_normals and choose_grid
Result<Prepared> prepare(std::vector<Surface> surfaces, const Run &run);

} // namespace pbm::build
