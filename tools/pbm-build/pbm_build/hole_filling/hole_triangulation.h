// The triangles that span a hole of a mesh, between the vertices of its rim.
// Based on: Liepa. Filling Holes in Meshes. 2003, section 3
// Based on: Barequet, Sharir. Filling Gaps in the Boundary of a Polyhedron. 1995 (the dynamic programme)
#pragma once

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace pbm::build {

struct RimVertex {
    glm::dvec3 position{0};
    // Of the face of the mesh at the edge to the next vertex: unit length; 0: it has no plane.
    glm::dvec3 face_normal{0};
    double edge_length = 0; // mean of the mesh's edges at this vertex
    // Of the faces of the mesh at this vertex (fair_patch.h).
    double outside_weight = 0; // sum of the weights of its neighbours in them
    glm::dvec3 outside_sum{0}; // of the neighbours' positions, with these weights
    double outside_area = 0;   // a third of their area
};

// In units in which the rim is about 1 long. The order is that in which the new faces pass the edges of the rim.
struct Rim {
    std::vector<RimVertex> vertices;
    std::vector<std::array<std::uint32_t, 2>> chords; // edges of the mesh from rim to rim, ascending, smaller end first
};

using PatchTriangle = std::array<std::uint32_t, 3>;

// Of all triangulations that of the smallest weight: first the largest bend between two faces, those beside the rim
// included, then the area. Makes no second edge beside a chord. Time: the cube of the number of vertices; memory: 48
// bytes for each pair of them. Nothing where all triangulations have a chord or a face without area.
std::optional<std::vector<PatchTriangle>> triangulate_hole(const Rim &rim);

} // namespace pbm::build
