// Radii of splats that end where a mesh ends, instead of up to a radius beyond.
#pragma once

#include "pbm_build/voxels/voxelize.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

namespace pbm::build {

// Shrinks radii near the edges of `surface` that have one face. With the distance d of the voxel's centre from the edge
// in the tangent plane, voxels:
//
//   radius = sqrt(d^2 + 0.05)    inside: the splats along a straight edge end at it on average
//   radius = 0.05                beyond the edge: the splats inside cover what the voxel holds
//
// Other voxels keep theirs. `voxels`: of the whole surface, or of a part. Nothing happens if so many faces are loose
// that their edges are no border of a surface.
void shrink_at_borders(const Surface &surface, const Grid &grid, Voxels &voxels, int threads);

// Whether this is the radius of such a voxel, not one of the input, which may be 0: none.
bool ends_at_border(std::uint8_t radius, int depth);

// Undoes it where another surface continues behind the border, so that no gap opens between them. `voxels`: of all
// parts, with all of their normals.
void restore_where_surface_continues(Voxels &voxels, int depth, int threads);

} // namespace pbm::build
