// How large the splat of each point is, as indices of the normative radius table. BVG.md section 6.2.
// Based on: Campbell. Point Based Modelling and Rendering. 2006, sections 4.2 and 4.3 (a splat reaches its neighbours)
#pragma once

#include "pbm_build/voxels/voxelize.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

namespace pbm::build {

// Radius of points whose voxels leave no gap: 0.89 voxels, a little more than half a voxel's diagonal, so that a splat
// covers every point of the surface inside its voxel. Below depth 5 the limit of 5 % of the grid's edge makes it
// smaller.
std::uint8_t dense_radius(int depth);

// Radii that the coarser levels cannot tell apart are one class, since finer steps are noise that costs bits: of the
// indices that look the same two levels up (6.2.3) only the largest is used, and dense_radius. Near that three or four
// indices make a class, from three voxels on each its own. Here is the class of every index: the smallest that is not
// below it, kMaxFinestRadius if none is.
using RadiusClasses = std::array<std::uint8_t, 256>;
RadiusClasses radius_classes(int depth);

// Radii of the input as table indices, a class each; empty where it has none. Triangles are sampled densely: theirs are
// kept within 0.89 and 2 voxels. Beside triangles, points without a radius get 0.
Bytes given_radii(const Surface &surface, const Grid &grid);

// For points that have none, which is radius 0, in place. The points below one node of the next level share the largest
// radius among them up to a factor of 1.5: what a node foretells costs nothing. A splat covers the Voronoi cell of its
// voxel in the tangent plane, but reaches no farther than the eighth nearest voxel; where the cell is open, at a
// border, the fifth. Sparse points are held at three times the median distance to the eighth, outliers (outliers.h) at
// that median. Normals must be complete.
void radii_from_neighbours(Voxels &voxels, int depth, int threads);

// Replaces kNoNormal: the direction of the mean of the normals of the nearest 16 voxels, else +Z, two-sided.
void fill_normals(Voxels &voxels, int threads);

} // namespace pbm::build
