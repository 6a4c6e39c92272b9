// Normals, colours and materials of a mesh by the rules of the builder, implemented independently.
#pragma once

#include "triangle_mesh.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// Arrays are per vertex unless stated otherwise.
struct SurfaceLook {
    std::vector<glm::vec3> normals;      // unit vectors
    std::vector<std::uint8_t> is_flat;   // [triangles] 1: at a crease, the triangle has the normal of its plane
    std::vector<glm::vec3> colours;      // linear light 0..1; empty: the colour of the material
    std::vector<std::uint8_t> materials; // index; empty: 0
};

// Normal = the given one, normalized. If it is zero or none are given: the normalized sum of the unit normals of the
// adjacent faces. A triangle is flat if the normal of a corner differs from its own by 45 degrees or more.
SurfaceLook look_of(const TriangleMesh &mesh, std::span<const glm::vec3> given_normals = {});

// Whether the given normals mostly disagree with the winding of the faces.
bool faces_point_inward(const TriangleMesh &mesh, std::span<const glm::vec3> given_normals);

// sRGB to linear light 0..1 and back, unrounded, by the formula of IEC 61966-2-1.
double to_linear(std::uint8_t srgb);
double to_srgb(double linear); // 0..255, clamped

} // namespace pbm
