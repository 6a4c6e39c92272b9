// Splats around the eye: discs that each ray meets exactly. The ellipses of splat.h do not hold there, since a disc may
// reach behind the eye.
// Based on: Botsch, Hornung, Zwicker, Kobbelt. High-Quality Surface Splatting on Today's GPUs. 2005 (ray casting of
// discs)
#pragma once

#include "pbm_render/bricks/frame_geometry.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace pbm {

struct DepthStrip;
struct Framebuffer;

// A point nearer to the eye, in depth, than kMinRadii splat radii + kMinVoxels voxels is drawn as such a disc. Points
// that are drawn as blocks of pixels are always farther away.
inline constexpr float kMinRadii = 1.25F, kMinVoxels = 2;

// Sides (kSideBit) are drawn up to this cosine between normal and ray: of an edge-on card, whose normals are quantised,
// one side is seen.
inline constexpr float kSideSlack = 0.03F;

// Eye space (EyeNormal), lengths in grid edges.
struct NearSplat {
    std::array<float, 3> centre;
    std::array<float, 3> normal; // unit; either side may face the eye
    float radius;
    float cone; // added to the depth of the outline
    std::uint32_t id;
};

// Pixels left .. right - 1 of rows top .. bottom - 1.
struct PixelBox {
    int left, right, top, bottom;
};

// Bounds of the pixels that show the splat, within `picture`. A splat that reaches behind the eye may be unbounded on
// one side or on both.
PixelBox bounds_of(const NearSplat &splat, const FrameGeometry &frame, const PixelBox &picture);

// Writes the depths, grid edges, of the pixels of row `y` from column `left` on; infinity where they do not show the
// splat.
void find_depths(const NearSplat &splat, const FrameGeometry &frame, int y, int left, std::span<float> depths);

// Draws the splats where they are nearer than the strip's depths.
void draw_near(std::span<const NearSplat> splats, const FrameGeometry &frame, DepthStrip &strip);

// A point around the eye.
struct PointAroundEye {
    glm::vec3 image;             // M * centre of its voxel: pixel times depth, depth
    std::uint16_t normal;        // as drawn: with kRoundBit or kSideBit
    float radius;                // grid edges
    std::optional<float> offset; // of the surface along the normal, voxels; absent: what the normal says
    std::uint32_t id;            // stands for its colour
};

// Draws it where it is nearer than the depths of `target`, which are grid edges. `voxel`: edge of its level. Returns
// false if it lies behind the eye or outside of the picture, or faces away and has no back that
// `shows_backs` asks for.
bool draw_near(const PointAroundEye &point, float voxel, bool shows_backs, const FrameGeometry &frame,
               Framebuffer &target);

} // namespace pbm
