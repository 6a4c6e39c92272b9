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

// A voxel whose surface offset (Offsets, model.h) is not known: it holds a thin wall, or its surface lies more than
// Offsets::kMost from its centre.
inline constexpr std::int8_t kNoOffset = -128;

struct Voxels {
    std::vector<MortonCode> codes;    // ascending, unique
    PointAttributes points;           // radii: the largest of the samples
    std::vector<Bytes> fields;        // [fields] stored values
    std::vector<std::int8_t> offsets; // [codes] as Offsets has them, or kNoOffset; empty if nobody asked for them
    VoxelSides sides;
    std::vector<MortonCode> made; // those of `codes` that up-sampling filled, ascending
};

// Appends sides of later voxels.
void append_sides(const VoxelSides &from, const AttributeSet &set, VoxelSides &to);

// Takes the hits in the buckets of `range` out of `store`, which was filled from `sampler`, and averages their samples.
// `fields`: those of the sampler. `with_offsets`: also finds where the surface lies; the surface has no points without
// faces.
Voxels voxelize(const SurfaceSampler &sampler, HitStore &store, const BucketRange &range, const AttributeSet &set,
                std::span<const Field> fields, bool with_offsets, int threads);

} // namespace pbm::build
