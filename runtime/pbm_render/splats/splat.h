// Computes the image of a point on the screen: an ellipse.
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

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
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
// Bounds of the covariance matrix of an ellipse. Of large splats seen edge-on rounding errors are larger than what is
// left of the matrix, and would turn the ellipse into a hyperbola, which fills the box around it.
inline constexpr float kMaxCorrelation = 0.9999F; // xy^2 / (xx yy): 1 is that of a line
inline constexpr float kMinVariance = 1 / 16.0F;  // xx and yy over the least eigenvalue of the ellipsoid, at depth 1
// Clamps the depth slope of a plane per screen axis: beyond 70 degrees, normals are too noisy to determine the depth
// one pixel away from the point.
inline constexpr float kSteepest = 3;
// Placed splats are thinner (factor kPlacedThickness) and less steep (kPlacedSteepest replaces kSteepest). They are
// smaller, because a disc on the surface covers its voxel with a smaller radius r than a disc beside it:
// placed r^2 = max(r^2 - (kPlacedShrink * offset)^2, (kPlacedMin * r)^2).
inline constexpr float kPlacedThickness = 0.6F, kPlacedSteepest = 2, kPlacedShrink = 0.3F, kPlacedMin = 0.3F;
// Replaces kOutlineInset for placed splats.
inline constexpr float kPlacedOutlineInset = 0.2F;
// Added to it in fine pictures, whose outlines then lie nearer to those of the surface. With 0.1 smooth outlines lie
// where the surface has them on average, but relief that is finer than a voxel gets holes. Fast pictures show one splat
// per pixel, and need wider ones to close corners.
inline constexpr float kFineInset = 0.07F;
// Replace kOutlineInset and kPlacedOutlineInset for splats that are drawn as blocks of pixels: blocks are larger than
// the ellipses that they replace.
inline constexpr float kBlockOutlineInset = 0.6F, kPlacedBlockOutlineInset = 0.5F;
// How far the outline of a placed splat lies behind its plane, voxel edges. Where two splats overlap, each is then
// visible around its own middle.
inline constexpr float kPlacedCone = 0.7F;

// The image of a splat at depth 1, for one normal, radius and ray direction; points of one normal and radius in a small
// part of the screen share it. At depth z the ellipse is scaled by 1 / z, the slope by z.
struct SplatShape {
    glm::vec2 shift;   // from the point to the middle of the ellipse
    glm::vec2 reach;   // half the edges of the box around the ellipse
    float xx, xy, yy;  // pixel (x, y) from the middle is inside if x (xx x + xy y) + yy y^2 <= 1
    glm::vec2 slope;   // of the depth, model units per pixel
    float depth_shift; // from the point's depth to the middle's, model units, at any depth
};

// Sizes in model space. A two-sided splat stays at its voxel's centre.
struct SplatSize {
    float radius;
    float voxel; // edge; negative for the back of a point, whose normal is turned: inwards is the other way
    bool two_sided;
    std::optional<float> offset = {}; // voxel edges; if present, the splat is placed
};

// Shape of a splat with this normal, seen through `pixel`. `facing` = normal.plane . (pixel, 1). Inlined, since callers
// store the shape in forms of their own.
[[gnu::always_inline]] inline SplatShape project_splat(const Projection &projection, const ScreenNormal &normal,
                                                       glm::vec2 pixel, float facing, SplatSize size) {
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
    float xx = r2 * (focal * focal + o.x * o.x) - flat * (n.x * n.x);
    float xy = r2 * (o.x * o.y) - flat * (n.x * n.y);
    float yy = r2 * (focal * focal + o.y * o.y) - flat * (n.y * n.y);
    if (!(xx * yy - xy * xy > (1 - kMaxCorrelation) * (xx * yy))) [[unlikely]] {
        const float least = kMinVariance * (r2 - flat) * focal * focal;
        xx = std::max(xx, least);
        yy = std::max(yy, least);
        const float most_xy = std::sqrt(kMaxCorrelation * (xx * yy));
        xy = std::clamp(xy, -most_xy, most_xy);
    }
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
