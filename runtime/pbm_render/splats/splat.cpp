#include "pbm_render/splats/splat.h"

#include <glm/common.hpp>

namespace pbm {

SplatShape project_splat(const Projection &projection, const ScreenNormal &normal, glm::vec2 pixel, float facing,
                         SplatSize size) {
    const auto focal = static_cast<float>(projection.focal);
    const glm::vec2 o = pixel - glm::vec2(projection.middle);
    // The normal through the Jacobian of the projection at depth 1.
    const glm::vec2 n(normal.image.x - pixel.x * normal.image.z, normal.image.y - pixel.y * normal.image.z);
    // The covariance matrix r^2 I - (r^2 - t^2) n n^T of the ellipsoid, projected likewise; the ellipse is its inverse.
    const bool placed = size.offset.has_value();
    float r2 = size.radius * size.radius;
    if (placed) {
        const float moved = kPlacedShrink * *size.offset * size.voxel;
        r2 = std::max(r2 - moved * moved, kPlacedMin * kPlacedMin * r2);
    }
    const float thickness = normal.thickness * size.voxel * (placed ? kPlacedThickness : 1);
    const float flat = std::max(r2 - thickness * thickness, 0.0F);
    const float xx = r2 * (focal * focal + o.x * o.x) - flat * (n.x * n.x);
    const float xy = r2 * (o.x * o.y) - flat * (n.x * n.y);
    const float yy = r2 * (focal * focal + o.y * o.y) - flat * (n.y * n.y);

    const float inverse = 1 / (xx * yy - xy * xy);

    const float steepest = (placed ? kPlacedSteepest : kSteepest) / focal;
    const glm::vec2 slope =
        glm::clamp(glm::vec2(normal.plane.x, normal.plane.y) / std::max(-facing, kEdgeOn), -steepest, steepest);
    glm::vec2 shift(0);
    float depth_shift = 0;
    if (!size.two_sided) {
        // edge_on: 0 for a splat seen from the front, 1 edge-on.
        const float edge_on = std::clamp(1 + facing, 0.0F, 1.0F);
        const float inset =
            (placed ? -*size.offset : normal.inset + kGrazingInset * edge_on * edge_on * edge_on) * size.voxel;
        const float outline_inset =
            (placed ? kPlacedOutlineInset : kOutlineInset) + (size.voxel < 0 ? kBackOutlineInset : 0);
        const float outline =
            outline_inset * std::clamp(1 + kOutlineSlope * facing, 0.0F, 1.0F) * size.voxel + (placed ? inset : 0);
        shift = -outline * n;
        depth_shift = glm::dot(slope, (inset - outline) * n) - inset * normal.image.z;
    }
    const glm::vec2 reach(std::sqrt(xx), std::sqrt(yy));
    return {.box = Float4{shift.x - reach.x, shift.x + reach.x, shift.y - reach.y, shift.y + reach.y},
            .shift = Float4{shift.x, shift.x, shift.y, shift.y},
            .xx = Float4{} + yy * inverse,
            .xy = Float4{} - 2 * xy * inverse,
            .yy = Float4{} + xx * inverse,
            .slope_x = Float4{} + slope.x,
            .slope_y = Float4{} + slope.y,
            .depth_shift = Float4{} + depth_shift};
}

namespace {

// At the right border, the second column of a block would be the next row's first pixel: it must not be drawn.
template <bool kCone, bool kAtRightBorder>
void draw_all_blocks(const SplatShape &shape, const SplatPixels &splat, Float4 first_x, Float4 y, Int4 box,
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
void draw_blocks(const SplatShape &shape, const SplatPixels &splat, Float4 first_x, Float4 y, Int4 box,
                 Framebuffer &target) {
    if (box[1] == target.width)
        draw_all_blocks<kCone, true>(shape, splat, first_x, y, box, target);
    else
        draw_all_blocks<kCone, false>(shape, splat, first_x, y, box, target);
}

template void draw_blocks<false>(const SplatShape &, const SplatPixels &, Float4, Float4, Int4, Framebuffer &);
template void draw_blocks<true>(const SplatShape &, const SplatPixels &, Float4, Float4, Int4, Framebuffer &);

} // namespace pbm
