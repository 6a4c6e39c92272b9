// How the triangles of a surface are connected. Equal positions are one vertex here, whatever their attributes, so that
// a seam of a texture or of normals is no border.
#pragma once

#include "pbm_build/surface/half_edge.h"
#include "pbm_scan/surface/surface.h"

#include <array>

namespace pbm::build {

// Further sides without a mate, by reason.
inline constexpr HalfEdge kComplex = kBoundary - 1; // two or more others are at this edge
inline constexpr HalfEdge kCut = kBoundary - 2;     // one other face is, but the faces around have no common winding
inline constexpr bool is_mate(HalfEdge h) { return h < kCut; }

struct WeldedMesh {
    struct Face {
        std::array<std::uint32_t, 3> corners; // vertices, the smallest first; wound as the triangle
        std::uint32_t triangle;               // of the surface
    };
    // Triangles that are no faces of the mesh.
    struct Repeated {
        std::uint32_t triangle, face; // the face with the same three vertices
    };

    std::vector<std::uint32_t> vertex_of; // [positions]
    std::vector<glm::dvec3> positions;    // [vertices], ascending by x, then y, then z
    std::vector<Face> faces;              // ascending by their vertices: their order does not depend on the file's
    std::vector<Repeated> repeated;
    std::vector<std::uint8_t>
        both_ways;                   // [faces] 1: a repeated triangle is wound the other way: the face fits any winding
    std::vector<std::uint32_t> flat; // triangles of which two corners are one vertex
    std::vector<HalfEdge> mates; // [3 * faces] the side of the one other face at the same edge, or why there is none
    struct ComplexSide {
        HalfEdge side, first; // `first`: one side of each complex edge, for all of its sides
    };
    std::vector<ComplexSide> complex_sides;
    std::uint64_t edges = 0, boundary_edges = 0, complex_edges = 0;

    std::uint32_t from(HalfEdge h) const { return faces[h / 3].corners[h % 3]; }
    std::uint32_t to(HalfEdge h) const { return from(next_side(h)); }
};

// At most kMaxMeshFaces triangles.
WeldedMesh weld(const Surface &surface);

// Sets of numbers 0..count-1 that are joined pair by pair. The number of a set is its smallest member.
class JoinedSets {
  public:
    explicit JoinedSets(std::size_t count) : parents_(count) {
        for (std::size_t i = 0; i < count; ++i)
            parents_[i] = static_cast<std::uint32_t>(i);
    }
    std::uint32_t find(std::uint32_t i) {
        while (parents_[i] != i)
            i = parents_[i] = parents_[parents_[i]];
        return i;
    }
    void join(std::uint32_t a, std::uint32_t b) {
        a = find(a);
        b = find(b);
        parents_[std::max(a, b)] = std::min(a, b);
    }

  private:
    std::vector<std::uint32_t> parents_;
};

} // namespace pbm::build
