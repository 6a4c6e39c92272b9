// Averages samples to points: sorted, unique Morton codes with quantised attributes.
// Based on: Campbell. Point Based Modelling and Rendering. 2006, section 4.1 (points in one voxel are averaged)
#pragma once

#include "pbm_build/voxels/sample_points.h"
#include "pbm_build/voxels/voxel_sums.h"
#include "pbm_format/model/streams.h"

#include <vector>

namespace pbm::build {

// Both sides of voxels that hold a thin wall.
struct VoxelSides {
    std::vector<MortonCode> codes; // ascending
    PointAttributes values;        // [codes][2], without radii: as Sides has them
};

struct Voxels {
    std::vector<MortonCode> codes; // ascending, unique
    PointAttributes points;        // radii: the largest of the samples
    std::vector<Bytes> fields;     // [fields] stored values
    VoxelSides sides;
    std::vector<MortonCode> made; // those of `codes` that up-sampling filled, ascending
};

// Appends sides of later voxels.
void append_sides(const VoxelSides &from, const AttributeSet &set, VoxelSides &to);

// Takes the hits in the buckets of `range` out of `store`, which was filled from `sampler`, and averages their samples.
// `fields`: those of the sampler.
Voxels voxelize(const SurfaceSampler &sampler, HitStore &store, const BucketRange &range, const AttributeSet &set,
                std::span<const Field> fields, int threads);

} // namespace pbm::build
