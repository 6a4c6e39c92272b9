// A part of a model that is built by several processes: the points of a range of the Morton curve, before anything is
// computed that needs their neighbours.
#pragma once

#include "pbm_build/parts/bucket_ranges.h"
#include "pbm_build/report/build_statistics.h"
#include "pbm_build/voxels/voxelize.h"
#include "pbm_format/model/model.h"

#include <string>
#include <vector>

namespace pbm::build {

struct Part {
    ModelParameters parameters; // without a scene
    std::string metadata;
    bool has_points = false; // without faces
    Voxels voxels;           // without what fill_normals and radii_from_neighbours add
    // Of reading and sampling: attributes, what the input has, samples and made points.
    BuildStatistics statistics;
};

// The whole of some parts, which must be all parts of one scan in their order.
Part join(std::vector<Part> parts);

} // namespace pbm::build
