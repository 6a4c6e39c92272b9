// Normals, colours and materials of a mesh by the rules of the builder, implemented independently.
#pragma once

#include "triangle_mesh.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace pbm {

// Arrays are per vertex unless stated otherwise.
struct SurfaceLook {
    std::vector<std::array<glm::vec3, 3>> normals; // [triangles][corner], unit vectors
    std::vector<glm::vec3> colours;                // linear light 0..1; empty: the colour of the material
    std::vector<std::uint8_t> materials;           // index; empty: 0
    // Linear light of the image of a triangle at the place with these weights of its corners; nothing for a triangle
    // without one. Empty: no triangle has one.
    std::function<std::optional<glm::dvec3>(std::size_t triangle, const glm::dvec3 &weights)> image{};
    // The unit normal that a normal map makes of `normal` there. Empty: no triangle has one.
    std::function<glm::dvec3(std::size_t triangle, const glm::dvec3 &weights, const glm::dvec3 &normal)> relief{};
};

// A given normal, normalized, holds for all corners at its vertex. If it is zero or none are given: the normalized sum
// of the unit normals of those adjacent faces that meet this one at less than 75 degrees. If at least 0.3 of the area
// has a neighbour in the same plane (0.1 degrees), the limit is 44 degrees, faces in one plane count once, and not at
// all where another plane among these is more than 16 times as large.
SurfaceLook look_of(const TriangleMesh &mesh, std::span<const glm::vec3> given_normals = {});

// Whether the given normals mostly disagree with the winding of the faces.
bool faces_point_inward(const TriangleMesh &mesh, std::span<const glm::vec3> given_normals);

// sRGB to linear light 0..1 and back, unrounded, by the formula of IEC 61966-2-1.
double to_linear(std::uint8_t srgb);
double to_srgb(double linear); // 0..255, clamped

} // namespace pbm
