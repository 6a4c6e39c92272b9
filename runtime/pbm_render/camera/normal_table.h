// The 8,192 normals as a frame needs them: computed once per frame, looked up per point.
// Based on: Zhang, Hoff. Fast Backface Culling Using Normal Masks. 1997; Botsch, Wiratanaya, Kobbelt 2002
#pragma once

#include "pbm_render/camera/transform_table.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// Flipping these bits of a normal's index mirrors its triangle in all three axes: the opposite normal.
inline constexpr std::size_t kOppositeNormal = 7U << 10;

// One normal as a frame sees it, and how splats that carry it are laid; see splat.h.
struct ScreenNormal {
    glm::vec3 image; // M * (normal, 0)
    glm::vec3 plane; // Projection::plane(normal)
    float thickness; // of the splat, voxel edges
    float inset;     // of the depth plane, voxel edges
};

// The part of it that no frame changes, with the unit normal in model space: [kNormalCount].
struct SplatNormal {
    float x, y, z;
    float thickness, inset;
};
std::span<const SplatNormal> splat_normals();
std::span<const float> splat_thickness(); // the same numbers beside each other

// [kNormalCount]
std::vector<ScreenNormal> transform_normals(const Projection &projection);

// Which way a normal faces, for all points of a cube.
enum class Facing : std::uint8_t {
    away,  // from the eye, wherever in the cube
    some,  // depends on the point
    front, // towards the eye, wherever in the cube
    both,  // two-sided
};

// Points are dropped as facing away where normal . unit ray from the eye is above this: normals are averages over a
// voxel, and the surface in it may still show a part of its front.
inline constexpr float kFacingSlack = 0.1F;

// Radii of splats in grid edges, by radius index.
const std::array<float, 256> &radius_table();

// One per stored normal value, two-sided bit included: [2 * kNormalCount]. Proven at the cube's corners, so never wrong
// for a point inside. `centre` and `half_edge` in model space.
void mark_facing(const glm::dvec3 &eye, const glm::dvec3 &centre, double half_edge, std::vector<Facing> &facing);

} // namespace pbm
