// From samples to points: sorted, unique Morton codes with averaged, quantised attributes.
// Based on: Campbell. Point Based Modelling and Rendering. 2006, section 4.1 (points in one voxel are averaged)
#pragma once

#include "pbm_build/sample_points.h"
#include "pbm_format/point_attributes.h"

#include <vector>

namespace pbm::build {

// Normal of a voxel none of whose samples has one. `fill_normals` (splat_radius.h) replaces it.
inline constexpr std::uint16_t kNoNormal = 0xFFFF;

struct Voxels {
    std::vector<MortonCode> codes; // ascending, unique
    PointAttributes points;        // radii: the largest of the samples
};

// Attributes of one voxel from all its samples: integer sums, one vote each, so that their order does not matter.
// A thin wall, whose normals cancel to less than half the votes, becomes two-sided with the normal of its plane. So
// does a voxel half of whose votes are two-sided themselves, with the direction of their sum where they do not cancel.
// Colours are averaged in linear light; materials by majority, ties to the lowest index; the largest radius wins.
struct VoxelAttributes {
    std::uint16_t normal; // index | kTwoSidedBit, or kNoNormal
    Rgb8 colour;
    std::uint8_t material;
    std::uint8_t radius;
};
VoxelAttributes average_samples(std::span<const Sample *const> samples);

// Takes all hits out of `store`, bucket by bucket, samples `sampler` at them and averages. `store` was filled from
// `sampler`.
Voxels voxelize(const SurfaceSampler &sampler, HitStore &store, const AttributeSet &set, int threads);

} // namespace pbm::build
