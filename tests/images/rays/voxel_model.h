// A model made by brute force, independent of the builder: every voxel that a triangle touches.
#pragma once

#include "pbm_format/model/model.h"
#include "triangle_mesh.h"

namespace pbm {

// The cube is `cube_edge` wide around the origin. Normals: sum of the unit normals of the triangles in the voxel;
// radius: the least index that reaches 0.87 voxel edges; no colours.
Model voxelise_by_brute_force(const TriangleMesh &mesh, int depth, double cube_edge);

} // namespace pbm
