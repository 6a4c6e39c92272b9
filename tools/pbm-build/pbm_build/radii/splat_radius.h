// Splat radii as indices of the normative radius table. BVG.md 6.2.
// Based on: Campbell. Point Based Modelling and Rendering. 2006, sections 4.2 and 4.3 (a splat reaches its neighbours)
#pragma once

#include "pbm_build/voxels/voxelize.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

namespace pbm::build {

// Radius where every voxel of the surface is occupied: 0.89 voxels, slightly more than half a voxel's diagonal, so that
// a splat covers all of the surface within its voxel. Below depth 5 it is clamped to 5 % of the grid's edge.
std::uint8_t dense_radius(int depth);

// Radii that yield the same radius two levels up (6.2.3) form one class, of which only the largest index is used: finer
// steps are noise that costs bits. dense_radius is a class of its own. Near it a class has three or four indices; from
// three voxels on each index is a class. classes[index]: the smallest class index that is >= index, else
// kMaxFinestRadius.
using RadiusClasses = std::array<std::uint8_t, 256>;
RadiusClasses radius_classes(int depth);

// Converts the radii of the input to class indices; empty where the input has none. Radii at triangles, which are
// sampled densely, are clamped to 0.89..2 voxels. Points without a radius get 0. Points in the middle of a voxel are
// those of a model of this grid, and keep a radius below 0.89 voxels.
Bytes given_radii(const Surface &surface, const Grid &grid);

// Computes the missing radii, those of index 0, in place. All normals must be set.
//
// The spacing of a voxel is the distance of its 8th nearest one, the spacing around it the median of its own and those
// of its nearest 12: at the edge of a hole it is that of the surface, not that of the hole.
//
//   radius = 1.1 x distance of the farthest corner of the Voronoi cell in the tangent plane (tangent_cell.h)
//   radius <= the spacing around; twice that for corners between neighbours on a flat surface, so that gaps in a dense
//             surface close
//   radius >= distance of the 5th nearest voxel, where the cell is open (at a border)
//   radius <= 3 x median spacing of all; that median itself for outliers (outliers.h)
//
// The radius of a round point (BVG.md 18) closes no gap: it is half the distance of its 2nd nearest voxel, in steps of
// a quarter of an octave. A splat beside round points ends where a neighbour lies farther off its plane than its 2nd
// nearest voxel is away.
//
// Where up-sampling made points, all spacings, and the 5th nearest voxel at a border, are those of the given points: a
// gap that was not filled stays as covered as it was.
//
// Points below one node of the next level share the largest of their radii, unless it is more than 1.5 times their own:
// a radius that equals its node's prediction costs no bits.
void radii_from_neighbours(Voxels &voxels, std::span<const Material> materials, int depth, int threads);

// Replaces each kNoNormal by the mean direction of the normals of the nearest 16 voxels, or by +Z, two-sided, where
// that mean is zero.
void fill_normals(Voxels &voxels, int threads);

} // namespace pbm::build
