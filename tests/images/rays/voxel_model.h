// Voxelizes by brute force, independent of the builder: every voxel that a triangle touches.
#pragma once

#include "pbm_format/model/model.h"
#include "triangle_mesh.h"

namespace pbm {

// The cube has edge `cube_edge` around the origin. Normal: sum of the unit normals of the triangles in the voxel.
// Radius: the smallest index that reaches 0.87 voxel edges. No colours.
Model voxelise_by_brute_force(const TriangleMesh &mesh, int depth, double cube_edge);

} // namespace pbm
