// Radii of splats that end where a mesh ends, instead of up to a radius beyond.
// Based on: Baerentzen, Aanaes. Signed Distance Computation Using the Angle Weighted Pseudonormal. 2005 (the side of a
// corner is that of the sum of its edges' directions)
#pragma once

#include "pbm_build/surface/half_edge.h"
#include "pbm_build/voxels/voxelize.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <span>
#include <vector>

namespace pbm::build {

// The sides at edges with one face; none if the mesh has more than kMaxMeshFaces faces.
std::vector<HalfEdge> border_sides(const Surface &surface, int threads);

// Shrinks radii near a border, of which `sides` are those of the whole surface. With the distance d of the voxel's
// centre from the border in the tangent plane, voxels:
//
//   radius = sqrt(d^2 + 0.05)    d <= 0.87, inside: the splats along a straight edge end at it on average
//   radius = 0.05                d <= 0.87, beyond the border
//
// Other voxels keep theirs, and so do those with a radius of the input above dense_radius. Nothing happens if the
// border is so long (2^20 voxels) that the faces are hair, grass or loose. `voxels`: of the whole surface, or of a
// part.
void shrink_at_borders(const Surface &surface, std::span<const HalfEdge> sides, const Grid &grid, Voxels &voxels,
                       int threads);

// Whether shrink_at_borders chose a radius. Neither does the input give one between 0, which is none, and dense_radius.
bool ends_at_border(std::uint8_t radius, int depth);

// Gives shrunk voxels dense_radius again where a gap might open: where a surface continues behind the border, where one
// meets another at its border, and in ribbons so narrow that no splat further inside covers its voxel. `voxels`: of all
// parts, with all of their normals.
void restore_where_gaps_open(Voxels &voxels, int depth, int threads);

} // namespace pbm::build
