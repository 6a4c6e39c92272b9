// Refines the triangles that span a hole until they are as dense as the mesh around.
// Based on: Liepa. Filling Holes in Meshes. 2003, section 4
// Based on: Pfeifle, Seidel. Triangular B-Splines for Blending and Filling of Polygonal Holes. 1996 (the criterion)
#pragma once

#include "pbm_build/hole_filling/hole_triangulation.h"

namespace pbm::build {

struct Patch {
    std::vector<glm::dvec3> positions; // those of the rim first
    std::vector<PatchTriangle> triangles;
    std::size_t rim = 0; // number of its vertices
};

// Splits triangles whose centres are farther from their corners than the edges there are long, and swaps edges that
// are not locally Delaunay. A round hole in an even mesh gets n^2 / 11 vertices, where n is the number of the rim's;
// none gets more than n^2 / 2 + 6 n, whatever its edges are.
Patch refine_patch(const Rim &rim, const std::vector<PatchTriangle> &triangles);

} // namespace pbm::build
