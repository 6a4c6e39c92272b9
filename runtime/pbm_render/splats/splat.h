// Points as ellipses on the screen: projection and drawing.
// Based on: Zwicker, Pfister, van Baar, Gross. EWA Splatting. 2002 (an ellipsoid through the local affine map);
//           Botsch, Wiratanaya, Kobbelt 2002; Rusinkiewicz, Levoy. QSplat. 2000
//
// A splat is a disc around the point, flattened but never flat: an ellipsoid with the splat radius r along the surface
// and a thickness t along the normal. Its image is an ellipse that cannot degenerate; its depth is that of a plane.
// The foremost voxels that a surface passes through have their centres in front of it, so both go a little back:
//
//      ======== voxel's centre ========
//      - - - -  depth plane  - - - - -    ScreenNormal::inset behind the centre: right on average
//      (     middle of the ellipse    )   up to kOutlineInset behind it at silhouettes, so that they keep their size
//
// Placed splats, whose points have an offset (SurfaceOffsets), know where the surface is and stand there.
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

// Voxel edges. The depth plane of a surface seen edge-on lies farther back, since the foremost of more voxels shows.
inline constexpr float kOutlineInset = 0.5F;
inline constexpr float kGrazingInset = 0.7F;
// Outlines begin to go back where this times the cosine of normal and ray is -1.
inline constexpr float kOutlineSlope = 1.4F;
// Planes are never taken to be seen at a flatter angle than with this cosine,
inline constexpr float kEdgeOn = 0.02F;
// nor to go deeper, along each axis of the screen, than this times what they cover of it: as they are up to 70 degrees;
// beyond, normals are too rough to say how deep a plane is a pixel away from its point.
inline constexpr float kSteepest = 3;
// Splats that are moved to where the surface is (SurfaceOffsets) are thinner by this factor, flatter, and smaller,
// since a disc that need not reach the surface from a centre off it covers its voxel with less: by so much of the way,
// and never by more than to kPlacedLeast of the radius.
inline constexpr float kPlacedThickness = 0.6F, kPlacedSteepest = 2, kPlacedShrink = 0.3F, kPlacedLeast = 0.3F;
// kOutlineInset of them.
inline constexpr float kPlacedOutlineInset = 0.2F;
// On their outlines they lie so many voxel edges behind their planes, so that of two that overlap each shows where it
// is nearer.
inline constexpr float kPlacedCone = 0.7F;
// Points nearer to the eye than so many splat radii and voxels together have the eye inside or next to them, and their
// planes would reach behind it: they are not drawn.
inline constexpr float kLeastRadii = 1.25F, kLeastVoxels = 2;

// What the image of a splat takes from its normal, its radius and the direction in which it is seen; the same for all
// points of one normal and radius in a small part of the screen. For depth 1: the ellipse shrinks with the depth, the
// slope grows with it. All but the box and the shift are four times the same number, ready for four pixels.
struct SplatShape {
    Float4 box;              // left, right, top, bottom of the ellipse, from the point
    Float4 shift;            // from the point to the middle of the ellipse: x, x, y, y
    Float4 xx, xy, yy;       // pixel (x, y) from the middle is inside if x (xx x + xy y) + yy y^2 <= 1
    Float4 slope_x, slope_y; // of the depth, model units per pixel
    Float4 depth_shift;      // from the point's depth to that in the middle, model units, the same for any depth
};

// Sizes in model space. `two_sided` points stand for both sides of their voxel: they stay where they are. Splats with
// an offset, in voxel edges, know where in their voxels the surface is.
struct SplatSize {
    float radius;
    float voxel;
    bool two_sided;
    std::optional<float> offset = {};
};

// Shape of splats with this normal that are seen through `pixel`. `facing` = normal.plane . (pixel, 1).
SplatShape lay_splat(const Projection &projection, const ScreenNormal &normal, glm::vec2 pixel, float facing,
                     SplatSize size);

// Two pixels of a row and the two below them.
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

// What is the same for all pixels of one splat.
struct SplatPixels {
    Float4 depth, at_middle; // of the point; in the middle of the ellipse
    Float4 inside;           // the quadratic form's value on the outline
    Float4 cone;             // of the depth, for 1 of the quadratic form
    Int4 indices;            // of the point
};

// Draws four pixels, those with all bits of `allowed` set; (x, y) from the middle of the ellipse to their centres.
template <bool kCone>
inline void draw_block(const SplatShape &shape, const SplatPixels &splat, Float4 x, Float4 y, float *depths,
                       std::uint32_t *indices, std::ptrdiff_t stride, Int4 allowed = Int4{-1, -1, -1, -1}) {
    const Float4 form = x * (shape.xx * x + shape.xy * y) + shape.yy * y * y;
    Float4 z = splat.depth * (shape.slope_x * x + shape.slope_y * y) + splat.at_middle;
    if constexpr (kCone)
        z += splat.cone * form;
    const Int4 old_depths = load_block(depths, stride);
    const Int4 old_indices = load_block(indices, stride);
    const Int4 wins = (form <= splat.inside) & (z < reinterpret_cast<Float4>(old_depths)) & allowed;
    // Pixels that do not win, beside the box too, are written back as they were.
    store_block(depths, stride, (reinterpret_cast<Int4>(z) & wins) | (old_depths & ~wins));
    store_block(indices, stride, (splat.indices & wins) | (old_indices & ~wins));
}

// The same for all blocks of a box (left, right, top, bottom).
template <bool kCone>
void draw_blocks(const SplatShape &shape, const SplatPixels &splat, Float4 first_x, Float4 y, Int4 box,
                 Framebuffer &target);

// Draws the splat of a point at `pixel` and `depth` > 0: the pixels whose centres lie in the ellipse and that are
// nearer than what is there. Any splat is allowed: what lies outside the framebuffer is clipped. On the outline depths
// lie by `cone` behind the plane if kCone.
template <bool kCone>
inline void draw_splat(const SplatShape &shape, glm::vec2 pixel, float depth, float inverse_depth, std::uint32_t index,
                       Framebuffer &target, float cone = 0) {
    const Float4 scale = Float4{} + inverse_depth;
    const Float4 point{pixel.x, pixel.x, pixel.y, pixel.y};
    // Pixel i is inside the box if its centre i + 0.5 is: the first one is floor(edge + 0.5), kept in the framebuffer.
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
    const std::ptrdiff_t stride = target.width; // one block: most splats of a whole model
    const std::ptrdiff_t at = top * stride + left;
    draw_block<kCone>(shape, splat, first_x, y, target.depth.data() + at, target.colour.data() + at, stride);
}

// Draws the one pixel that holds the splat's middle: all there is to draw of an ellipse at most a pixel wide.
inline void draw_pixel(const SplatShape &shape, glm::vec2 pixel, float depth, float inverse_depth, std::uint32_t index,
                       Framebuffer &target) {
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
