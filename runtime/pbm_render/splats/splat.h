// Computes and draws the image of a point on the screen: an ellipse.
// Based on: Zwicker, Pfister, van Baar, Gross. EWA Splatting. 2002 (an ellipsoid under the local affine map); Botsch,
// Wiratanaya, Kobbelt. Efficient High Quality Rendering of Point Sampled Geometry. 2002; Rusinkiewicz, Levoy. QSplat.
// 2000
//
// A splat is an ellipsoid around the point: its radius is the splat radius r along the surface and the thickness t
// along the normal. So its image is an ellipse that cannot degenerate. Its depth is that of a plane. The visible voxels
// of a surface have their centres in front of the surface, so ellipse and plane move back along the normal:
//
//   depth plane            by ScreenNormal::inset: the mean distance between these centres and the surface
//   middle of the ellipse  by 0 to kOutlineInset, most at silhouettes, so that outlines keep their size
//
// Placed splats belong to points with a surface offset (SurfaceOffsets): they lie on the estimated surface.
#pragma once

#include "pbm_render/camera/normal_table.h"
#include "pbm_render/picture/framebuffer.h"

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

namespace pbm {

// Voxel edges. The depth plane of a surface seen edge-on moves back by kGrazingInset more: more voxels lie behind each
// other there, and the foremost one is visible.
inline constexpr float kOutlineInset = 0.5F;
inline constexpr float kGrazingInset = 0.7F;
// Inset of the ellipse: kOutlineInset * clamp(1 + kOutlineSlope * cosine of normal and ray, 0, 1).
inline constexpr float kOutlineSlope = 1.4F;
// Added to the inset of the ellipses of backs: at a contour they stay behind the fronts beside them.
inline constexpr float kBackOutlineInset = 0.4F;
// Lower bound of the cosine between a plane's normal and the ray.
inline constexpr float kEdgeOn = 0.02F;
// Clamps the depth slope of a plane per screen axis: beyond 70 degrees, normals are too noisy to determine the depth
// one pixel away from the point.
inline constexpr float kSteepest = 3;
// Placed splats are thinner (factor kPlacedThickness) and less steep (kPlacedSteepest replaces kSteepest). They are
// smaller, because a disc on the surface covers its voxel with a smaller radius r than a disc beside it:
// placed r^2 = max(r^2 - (kPlacedShrink * offset)^2, (kPlacedMin * r)^2).
inline constexpr float kPlacedThickness = 0.6F, kPlacedSteepest = 2, kPlacedShrink = 0.3F, kPlacedMin = 0.3F;
// Replaces kOutlineInset for placed splats.
inline constexpr float kPlacedOutlineInset = 0.2F;
// Replace kOutlineInset and kPlacedOutlineInset for splats that are drawn as blocks of pixels: blocks are larger than
// the ellipses that they replace.
inline constexpr float kBlockOutlineInset = 0.6F, kPlacedBlockOutlineInset = 0.5F;
// How far the outline of a placed splat lies behind its plane, voxel edges. Where two splats overlap, each is then
// visible around its own middle.
inline constexpr float kPlacedCone = 0.7F;

// The image of a splat at depth 1, for one normal, radius and ray direction; points of one normal and radius in a small
// part of the screen share it. At depth z the ellipse is scaled by 1 / z, the slope by z. Each member but box and shift
// holds one number four times, for four pixels.
struct SplatShape {
    Float4 box;              // left, right, top, bottom of the ellipse, from the point
    Float4 shift;            // from the point to the middle of the ellipse: x, x, y, y
    Float4 xx, xy, yy;       // pixel (x, y) from the middle is inside if x (xx x + xy y) + yy y^2 <= 1
    Float4 slope_x, slope_y; // of the depth, model units per pixel
    Float4 depth_shift;      // from the point's depth to the middle's, model units, at any depth
};

// Sizes in model space. A two-sided splat stays at its voxel's centre.
struct SplatSize {
    float radius;
    float voxel; // edge; negative for the back of a point, whose normal is turned: inwards is the other way
    bool two_sided;
    std::optional<float> offset = {}; // voxel edges; if present, the splat is placed
};

// Shape of a splat with this normal, seen through `pixel`. `facing` = normal.plane . (pixel, 1).
SplatShape project_splat(const Projection &projection, const ScreenNormal &normal, glm::vec2 pixel, float facing,
                         SplatSize size);

// Loads or stores two pixels of a row and the two below them.
template <class T> Int4 load_block(const T *pixel, std::ptrdiff_t stride) {
    std::int64_t upper, lower;
    std::memcpy(&upper, pixel, sizeof upper);
    std::memcpy(&lower, pixel + stride, sizeof lower);
    return reinterpret_cast<Int4>(Long2{upper, lower});
}
template <class T> void store_block(T *pixel, std::ptrdiff_t stride, Int4 block) {
    const Long2 rows = reinterpret_cast<Long2>(block);
    const std::int64_t upper = rows[0], lower = rows[1];
    std::memcpy(pixel, &upper, sizeof upper);
    std::memcpy(pixel + stride, &lower, sizeof lower);
}

// Values that all pixels of one splat share.
struct SplatPixels {
    Float4 depth, at_middle; // of the point; in the middle of the ellipse
    Float4 inside;           // the quadratic form's value on the outline
    Float4 cone;             // added to the depth per unit of the quadratic form
    Int4 indices;            // of the point
};

// Position of two pixels of a row and the two below them.
struct PixelBlock {
    float *depths;          // of the upper left pixel
    std::uint32_t *indices; // the same
    std::ptrdiff_t stride;  // between rows, pixels
};

// Draws those pixels of a block whose bits in `allowed` are all set. (x, y): pixel centres from the ellipse's middle.
template <bool kCone>
inline void draw_block(const SplatShape &shape, const SplatPixels &splat, Float4 x, Float4 y, const PixelBlock &to,
                       Int4 allowed = Int4{-1, -1, -1, -1}) {
    const auto [depths, indices, stride] = to;
    const Float4 form = x * (shape.xx * x + shape.xy * y) + shape.yy * y * y;
    Float4 z = splat.depth * (shape.slope_x * x + shape.slope_y * y) + splat.at_middle;
    if constexpr (kCone)
        z += splat.cone * form;
    const Int4 old_depths = load_block(depths, stride);
    const Int4 old_indices = load_block(indices, stride);
    const Int4 wins = (form <= splat.inside) & (z < reinterpret_cast<Float4>(old_depths)) & allowed;
    // Pixels that do not win, and those beside the box, are written back unchanged.
    store_block(depths, stride, (reinterpret_cast<Int4>(z) & wins) | (old_depths & ~wins));
    store_block(indices, stride, (splat.indices & wins) | (old_indices & ~wins));
}

// Draws all blocks of a box (left, right, top, bottom).
template <bool kCone>
void draw_blocks(const SplatShape &shape, const SplatPixels &splat, Float4 first_x, Float4 y, Int4 box,
                 Framebuffer &target);

// The screen position and index of a point.
struct ScreenPoint {
    glm::vec2 pixel;
    float depth, inverse_depth; // depth > 0
    std::uint32_t index;
};

// Draws a splat: the pixels whose centres lie in the ellipse and that are nearer than the present depth. The part
// outside the framebuffer is clipped. kCone: depths at the outline lie `cone` behind the plane.
template <bool kCone>
inline void draw_splat(const SplatShape &shape, const ScreenPoint &drawn, Framebuffer &target, float cone = 0) {
    const auto [pixel, depth, inverse_depth, index] = drawn;
    const Float4 scale = Float4{} + inverse_depth;
    const Float4 point{pixel.x, pixel.x, pixel.y, pixel.y};
    // Pixel i is inside if its centre i + 0.5 is. So the first is floor(edge + 0.5), clamped to the framebuffer.
    const Float4 edges = point + scale * shape.box + 0.5F;
    const Float4 inner = edges > Float4{} ? edges : Float4{};
    const Int4 box = __builtin_convertvector(inner < target.limits ? inner : target.limits, Int4);
    const int left = box[0], right = box[1], top = box[2], bottom = box[3];
    if (left >= right || top >= bottom)
        return;

    const Float4 first = __builtin_convertvector(box, Float4) + 0.5F - (point + scale * shape.shift);
    const Float4 first_x = first[0] + Float4{0, 1, 0, 1};
    const Float4 y = first[2] + Float4{0, 0, 1, 1};
    const Float4 inside = scale * scale;
    const SplatPixels splat{.depth = Float4{} + depth,
                            .at_middle = shape.depth_shift + depth,
                            .inside = inside,
                            .cone = kCone ? cone / inside : Float4{},
                            .indices = Int4{} + static_cast<std::int32_t>(index)};
    if (right - left > 2 || bottom - top > 2 || right == target.width)
        return draw_blocks<kCone>(shape, splat, first_x, y, box, target);
    const std::ptrdiff_t stride = target.width; // a single block suffices for most splats of a whole model
    const std::ptrdiff_t at = top * stride + left;
    draw_block<kCone>(shape, splat, first_x, y, {target.depth.data() + at, target.colour.data() + at, stride});
}

// Draws the one pixel that holds the splat's middle, for ellipses at most a pixel wide.
inline void draw_pixel(const SplatShape &shape, const ScreenPoint &drawn, Framebuffer &target) {
    const auto [pixel, depth, inverse_depth, index] = drawn;
    const glm::vec2 middle = pixel + inverse_depth * glm::vec2(shape.shift[0], shape.shift[2]);
    const bool inside = middle.x >= 0 && middle.y >= 0 && middle.x < static_cast<float>(target.width) &&
                        middle.y < static_cast<float>(target.height);
    if (!inside)
        return;
    const int x = static_cast<int>(middle.x);
    const int y = static_cast<int>(middle.y);
    const auto at = static_cast<std::size_t>(std::ptrdiff_t{y} * target.width + x);
    const float rise = shape.slope_x[0] * (static_cast<float>(x) + 0.5F - middle.x) +
                       shape.slope_y[0] * (static_cast<float>(y) + 0.5F - middle.y);
    const float z = depth + shape.depth_shift[0] + depth * rise;
    if (z < target.depth[at]) {
        target.depth[at] = z;
        target.colour[at] = index;
    }
}

} // namespace pbm
