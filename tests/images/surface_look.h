// What rays find on a mesh: normals, colours and materials as the builder understands the input. Written apart from it.
#pragma once

#include "triangle_mesh.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// Of a vertex, unless it says otherwise.
struct SurfaceLook {
    std::vector<glm::vec3> normals;      // unit vectors
    std::vector<std::uint8_t> is_flat;   // [triangles] 1: across a crease, all of it has the normal of its plane
    std::vector<glm::vec3> colours;      // linear light 0..1; empty: the colour of the material
    std::vector<std::uint8_t> materials; // index; empty: 0
};

// Normals: those given, normalised; where one has no length, and everywhere if none are given, the direction of the sum
// of the unit normals of the faces around the vertex. A triangle with a corner whose normal is 45 degrees or more away
// from its own is flat.
SurfaceLook look_of(const TriangleMesh &mesh, std::span<const glm::vec3> given_normals = {});

// Whether the given normals mostly disagree with the winding of the faces.
bool faces_point_inward(const TriangleMesh &mesh, std::span<const glm::vec3> given_normals);

// sRGB bytes to linear light 0..1, and back, unrounded, by the standard's formula (IEC 61966-2-1).
double to_linear(std::uint8_t srgb);
double to_srgb(double linear); // 0..255, clamped

} // namespace pbm
