// Tangents at the corners of triangles with normal maps.
// Based on: Mikkelsen. Simulation of Wrinkled Surfaces Revisited. 2008
#pragma once

#include "pbm_build/surface/short_normal.h"
#include "pbm_scan/surface/surface.h"

#include <array>
#include <span>
#include <vector>

namespace pbm::build {

// The direction in which the normal map goes to the right, at each corner; zero: unknown.
struct TriangleTangents {
    std::array<ShortNormal, 3> along{};
    bool is_mirrored = false; // upwards in the image is tangent x normal, not normal x tangent
};

// [triangles]; empty without normal maps. A tangent that the file gives wins. Else each face has the gradient of its
// texture coordinates, and faces that share the position, normal, texture coordinates and sense of a corner have the
// mean of theirs in the plane of its normal, weighted by their angles there. `normals` [positions]: zero means that of
// the face's plane, reversed if `faces_point_inward`. The result does not depend on the order of faces.
std::vector<TriangleTangents> corner_tangents(const Surface &surface, std::span<const ShortNormal> normals,
                                              bool faces_point_inward, int threads);

} // namespace pbm::build
