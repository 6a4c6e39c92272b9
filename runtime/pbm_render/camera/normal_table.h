// Per-frame tables of the 8,192 normals, looked up per point.
// Based on: Botsch, Wiratanaya, Kobbelt. Efficient High Quality Rendering of Point Sampled Geometry. 2002
#pragma once

#include "pbm_format/model/normal.h"
#include "pbm_render/camera/projection.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// Flipping these bits of a normal's index gives the opposite normal: it mirrors the octant's triangle in all axes.
inline constexpr std::size_t kOppositeNormal = 7U << 10;

// Round points (BVG.md 18) are drawn as discs that face the eye, parallel to the picture. Bit 14 of the normals that
// are drawn marks them; stored normals have it clear. So the entries kRoundBit .. kRoundBit + kNormalCount - 1 of a
// table of normals face the eye.
inline constexpr std::uint16_t kRoundBit = 0x4000;
// Sides (BVG.md 19.4) are drawn where they face the eye alone: behind each lies another side of the same wall, which is
// a point of its own. Bit 15 of their normals marks them. Like two-sided points they lie at the centre of their voxel:
// surfaces that sink below it, each its own way, would cross.
inline constexpr std::uint16_t kSideBit = 0x8000, kSideBits = kSideBit | kTwoSidedBit;
// Points that are not drawn. No side is round.
inline constexpr std::uint16_t kHiddenBits = kRoundBit | kSideBit;
constexpr bool is_hidden(std::uint16_t drawn_normal) { return (drawn_normal & kHiddenBits) == kHiddenBits; }
inline constexpr std::size_t kDrawnNormals = kRoundBit + kNormalCount;
// The bits of a drawn normal that are its index into a table of a frame.
constexpr std::uint16_t drawn_normal_mask(bool has_round_points) {
    return static_cast<std::uint16_t>(kNormalIndexMask | (has_round_points ? kRoundBit : 0));
}
// Appends these entries to a table of kNormalCount normals.
template <class Normal> void append_facing(std::vector<Normal> &table, const Normal &facing) {
    table.resize(kDrawnNormals, facing);
}

// One normal in a frame, and the layout of splats that have it; see splat.h.
struct ScreenNormal {
    glm::vec3 image; // M * (normal, 0)
    glm::vec3 plane; // Projection::plane(normal)
    float thickness; // of the splat, voxel edges
    float inset;     // of the depth plane, voxel edges
};

// The part of a ScreenNormal that is the same in all frames, with the unit normal in model space: [kNormalCount].
struct SplatNormal {
    float x, y, z;
    float inset;
};
std::span<const SplatNormal> splat_normals();
std::span<const float> splat_thickness(); // voxel edges, [kNormalCount]

// [kNormalCount], or [kDrawnNormals]
std::vector<ScreenNormal> transform_normals(const Projection &projection);

// A point faces away if (normal . unit ray from the eye) exceeds this. Normals are averages over a voxel, and the
// surface within the voxel may still show part of its front.
inline constexpr float kFacingSlack = 0.1F;

// Radii of splats in grid edges, by radius index.
const std::array<float, 256> &radius_table();

} // namespace pbm
