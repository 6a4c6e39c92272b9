// How the faces of a surface meet at their edges, cheaply enough for every build: nothing is sorted but the sides at
// one vertex, and positions are compared at open edges only. welded_mesh.h costs more and says more.
#pragma once

#include "pbm_build/surface/half_edge.h"
#include "pbm_scan/surface/surface.h"

#include <array>
#include <vector>

namespace pbm::build {

// A patch is connected through edges that two faces pass in opposite directions: its faces are wound alike. Where a
// seam splits vertices, edges with equal positions are one edge, but for the
// rounding of single precision.
struct EdgeJoins {
    std::vector<std::uint32_t> patches; // [triangles] the number of its patch; 0 is that of the first triangle
    std::uint32_t patch_count = 0;
    std::vector<std::array<HalfEdge, 2>> against; // the two sides at an edge that both pass in the same direction
    std::vector<HalfEdge> open;                   // sides at edges with one face
    std::vector<HalfEdge> complex;                // sides at edges with more faces, or with the same face twice
    std::vector<std::size_t> complex_ends;        // [complex edges] where the sides of each end in `complex`
};

// At most kMaxMeshFaces triangles. The result does not depend on the number of threads.
// Memory: 8 bytes for each vertex, 16 for each triangle, and 24 for each vertex of an open edge.
EdgeJoins join_edges(const Surface &surface, int threads);

// Sets that several threads join at once.
// Based on: Anderson, Woll. Wait-Free Parallel Algorithms for the Union-Find Problem. 1991
class SharedSets {
  public:
    explicit SharedSets(std::size_t count);

    // The number of a set is its smallest member.
    std::uint32_t find(std::uint32_t i);
    void join(std::uint32_t a, std::uint32_t b);

  private:
    std::vector<std::uint32_t> parents_;
};

} // namespace pbm::build
