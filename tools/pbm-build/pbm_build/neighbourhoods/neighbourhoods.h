// Which points of a cloud lie on a surface: the others are twigs and leaves, wires, rain, noise.
// Based on: Demantké, Mallet, David, Vallet. Dimensionality Based Scale Selection in 3D Lidar Point Clouds. 2011
//           Weinmann, Jutzi, Hinz, Mallet. Semantic Point Cloud Interpretation Based on Optimal Neighborhoods. 2015
#pragma once

#include "pbm_build/voxels/voxelize.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm::build {

enum class Neighbourhood : std::uint8_t {
    planar,    // of a surface
    linear,    // along a curve, or alone
    scattered, // in all directions
};

// Eigenvalues a >= b >= c >= 0 of the covariance of a point's neighbours. Roughness: 255 c / b, rounded; 255 on a line.
struct Spread {
    std::uint8_t roughness = 255;             // at the point's own scale: that with the smallest roughness
    std::uint8_t at_few = 255, at_many = 255; // at the smallest scale and at the largest
    bool is_line = true; // b is at most kLineBreadth a, at all scales: the lines of a scanner lie on a surface
};
inline constexpr double kLineBreadth = 0.08;

// The neighbourhood of each point. It is scattered where the spreads of its neighbours and of theirs are round on the
// mean: a rough place or an edge of a surface lies among smooth ones. It is planar all the same
//   where the larger scale is smoother than the smaller one: it is a surface with noise;
//   everywhere in a cloud that looks like a body (outside_view.h) and is rough in few places: it is a statue of few
//   points, not a crown.
//
// `nearest`: [points][links] neighbours. The result depends on neither the number of threads nor the order of the
// points.
std::vector<Neighbourhood> classify(std::span<const std::uint32_t> nearest, std::size_t links,
                                    std::span<const Spread> spreads, bool looks_like_body, int threads);

// Gives points without a surface a material of round points (BVG.md 18): the copy of theirs that reflects the mean
// light of all directions and no highlight. `is_round`: [points without faces]. Returns whether there was room for the
// materials, kMaxMaterials in all.
bool make_round(Surface &surface, std::span<const std::uint8_t> is_round);

// Makes voxels of round points two-sided, all of whose normals are set. Leaves out materials that no voxel has, and
// their stream if one material is left. Voxels lose their sides, which would name the old materials. Without round
// points nothing changes.
void settle_round(Voxels &voxels, ModelParameters &parameters);

} // namespace pbm::build
