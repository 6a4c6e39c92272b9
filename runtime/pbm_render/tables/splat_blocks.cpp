#include "pbm_render/tables/splat_blocks.h"

namespace pbm {
namespace {

// At the right border, the second column of a block would be the next row's first pixel: it must not be drawn.
template <bool kCone, bool kAtRightBorder>
void draw_all_blocks(const BlockShape &shape, const SplatPixels &splat, Float4 first_x, Float4 y, Int4 box,
                     Framebuffer &target) {
    const int left = box[0], right = box[1], top = box[2], bottom = box[3];
    const std::ptrdiff_t stride = target.width;
    for (int row = top; row < bottom; row += 2, y += 2) {
        float *const depths = target.depth.data() + row * stride;
        std::uint32_t *const indices = target.colour.data() + row * stride;
        Float4 x = first_x;
        for (int column = left; column < right; column += 2, x += 2) {
            const std::int32_t second = !kAtRightBorder || column + 1 < right ? -1 : 0;
            draw_block<kCone>(shape, splat, x, y, {depths + column, indices + column, stride},
                              Int4{-1, second, -1, second});
        }
    }
}

} // namespace

template <bool kCone>
void draw_blocks(const BlockShape &shape, const SplatPixels &splat, Float4 first_x, Float4 y, Int4 box,
                 Framebuffer &target) {
    if (box[1] == target.width)
        draw_all_blocks<kCone, true>(shape, splat, first_x, y, box, target);
    else
        draw_all_blocks<kCone, false>(shape, splat, first_x, y, box, target);
}

template void draw_blocks<false>(const BlockShape &, const SplatPixels &, Float4, Float4, Int4, Framebuffer &);
template void draw_blocks<true>(const BlockShape &, const SplatPixels &, Float4, Float4, Int4, Framebuffer &);

} // namespace pbm
