// Draws splats in blocks of 2 x 2 pixels, one SIMD instruction for four pixels.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "pbm_render/splats/splat.h"

#include <cstring>

namespace pbm {

// A SplatShape for four pixels: each member but box and shift holds one number four times.
struct BlockShape {
    BlockShape() = default;
    explicit BlockShape(const SplatShape &s)
        : box{s.shift.x - s.reach.x, s.shift.x + s.reach.x, s.shift.y - s.reach.y, s.shift.y + s.reach.y},
          shift{s.shift.x, s.shift.x, s.shift.y, s.shift.y}, xx(Float4{} + s.xx), xy(Float4{} + s.xy),
          yy(Float4{} + s.yy), slope_x(Float4{} + s.slope.x), slope_y(Float4{} + s.slope.y),
          depth_shift(Float4{} + s.depth_shift) {}

    Float4 box;   // left, right, top, bottom of the ellipse, from the point
    Float4 shift; // from the point to the middle of the ellipse: x, x, y, y
    Float4 xx, xy, yy, slope_x, slope_y, depth_shift;
};

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
inline void draw_block(const BlockShape &shape, const SplatPixels &splat, Float4 x, Float4 y, const PixelBlock &to,
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
void draw_blocks(const BlockShape &shape, const SplatPixels &splat, Float4 first_x, Float4 y, Int4 box,
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
inline void draw_splat(const BlockShape &shape, const ScreenPoint &drawn, Framebuffer &target, float cone = 0) {
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
inline void draw_pixel(const BlockShape &shape, const ScreenPoint &drawn, Framebuffer &target) {
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
