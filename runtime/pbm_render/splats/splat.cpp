#include "pbm_render/splats/splat.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

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
    return {.shift = shift,
            .reach = {std::sqrt(xx), std::sqrt(yy)},
            .xx = yy * inverse,
            .xy = -2 * xy * inverse,
            .yy = xx * inverse,
            .slope = slope,
            .depth_shift = depth_shift};
}

} // namespace pbm
