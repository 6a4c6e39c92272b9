// Sides of triangles as half-edges.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

namespace pbm::build {

// Half-edge h is the side of face h / 3 that runs from its corner h % 3 to the next corner.
using HalfEdge = std::uint32_t;
inline constexpr HalfEdge next_side(HalfEdge h) { return h % 3 == 2 ? h - 2 : h + 1; }
inline constexpr HalfEdge previous_side(HalfEdge h) { return h % 3 == 0 ? h + 2 : h - 1; }

// Instead of the mate of a side: no other face is at this edge.
inline constexpr HalfEdge kBoundary = std::numeric_limits<HalfEdge>::max();

// OpenMesh numbers half-edges, of which single triangles have six, with 31 bits.
inline constexpr std::size_t kMaxMeshFaces = std::size_t{1} << 28;

} // namespace pbm::build
