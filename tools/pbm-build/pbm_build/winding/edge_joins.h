// How the faces of a surface meet at their edges. Fast enough for every build: only the sides at one vertex are sorted,
// and positions are compared at open edges only. welded_mesh.h is slower and says more.
#pragma once

#include "pbm_build/surface/half_edge.h"
#include "pbm_scan/surface/surface.h"

#include <array>
#include <vector>

namespace pbm::build {

// A patch is a set of faces that are connected through edges which two faces pass in opposite directions: its faces
// have one winding. A side is one face's half of an edge. At a seam, where vertices are split, edges count as one edge
// if their positions are equal up to the rounding of single precision.
struct EdgeJoins {
    std::vector<std::uint32_t> patches; // [triangles] the number of its patch; 0 is that of the first triangle
    std::uint32_t patch_count = 0;
    std::vector<std::array<HalfEdge, 2>> against; // the two sides of each edge that both faces pass in one direction
    std::vector<HalfEdge> open;                   // sides at edges with one face
    std::vector<HalfEdge> complex;                // sides at edges with more faces, or with the same face twice
    std::vector<std::size_t> complex_ends;        // [complex edges] where the sides of each end in `complex`
};

// `surface` has at most kMaxMeshFaces triangles. The result does not depend on the number of threads. Memory: 8 bytes
// for each vertex, 16 for each triangle, and 24 for each vertex of an open edge.
EdgeJoins join_edges(const Surface &surface, int threads);

// Disjoint sets (union-find) that several threads join at once.
// Based on: Anderson, Woll. Wait-Free Parallel Algorithms for the Union-Find Problem. 1991
class SharedSets {
  public:
    explicit SharedSets(std::size_t count);

    // Returns the number of the set that contains `i`: its smallest member.
    std::uint32_t find(std::uint32_t i);
    void join(std::uint32_t a, std::uint32_t b);

  private:
    std::vector<std::uint32_t> parents_;
};

} // namespace pbm::build
