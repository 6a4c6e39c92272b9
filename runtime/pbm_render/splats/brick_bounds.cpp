#include "pbm_render/splats/brick_bounds.h"

#include "pbm_render/splats/near_splat.h"
#include "pbm_render/splats/splat.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pbm {
namespace {

// Normals of FrameGeometry::packed are at most this long.
constexpr float kPackedLength = 1.01F;
// For rounding: relative to the depth; in pixels.
constexpr float kDepthSlack = 1e-6F, kPixelSlack = 0.1F;

// How far splats of a run reach from their points, in grid edges, for image vectors of length 1.
struct SplatReach {
    float across;  // middle of the splat, on the screen
    float forward; // depth of the middle
    float steepest;
};

SplatReach reach_of(const RunGeometry &run, bool shows_backs) {
    const float voxel = kPackedLength * run.voxel, back_inset = shows_backs ? kBackOutlineInset : 0;
    if (run.max_offset > 0) { // placed
        const float outline_inset = (kPlacedBlockOutlineInset + back_inset) * voxel;
        return {.across = outline_inset + run.max_offset,
                .forward = kPlacedSteepest * std::numbers::sqrt2_v<float> * outline_inset + run.max_offset,
                .steepest = kPlacedSteepest};
    }
    const float outline_inset = (kBlockOutlineInset + back_inset) * voxel,
                max_inset = (kPackedInsetMask / kPackedInsetScale + kGrazingInset) * voxel;
    return {.across = outline_inset,
            .forward = kSteepest * std::numbers::sqrt2_v<float> * std::max(max_inset, outline_inset) + max_inset,
            .steepest = kSteepest};
}

} // namespace

void bound_bricks(const FrameGeometry &frame, const RunGeometry &run, std::span<VisibleBrick> bricks) {
    constexpr float kHalf = 3.5F; // voxels from the middle of a brick to its outermost voxels' centres
    const auto &[step_x, step_y, step_z] = run.steps;
    const glm::vec3 to_middle = kHalf * (step_x + step_y + step_z);
    const float deep = kHalf * (std::abs(step_x.z) + std::abs(step_y.z) + std::abs(step_z.z));
    const SplatReach reach = reach_of(run, frame.shows_backs);
    const auto width = static_cast<float>(frame.width), height = static_cast<float>(frame.height);
    const std::span<const BrickRecord> records = run.run->chunk->bricks;
    for (VisibleBrick &it : bricks) {
        const glm::vec3 middle = glm::vec3(it.u, it.v, it.w) + to_middle;
        const float nearest = middle.z - deep;
        const float largest = frame.radii[records[it.brick].largest_radius];
        if (nearest <= deep + kMinRadii * largest + kMinVoxels * run.voxel) // the eye is near
            continue;
        const float x = middle.x / middle.z, y = middle.y / middle.z, pixels = 1 / nearest;
        const auto clamped = [](float v, float end) { return static_cast<std::int32_t>(std::clamp(v, 0.0F, end)); };
        const float block = static_cast<float>(it.block) / 2; // from its middle to the outermost pixels' centres
        const float farthest_pixel = (middle.z + deep) * frame.inverse_focal;
        const float half_x =
            kHalf * pixels *
            (std::abs(step_x.x - x * step_x.z) + std::abs(step_y.x - x * step_y.z) + std::abs(step_z.x - x * step_z.z));
        const float half_y =
            kHalf * pixels *
            (std::abs(step_x.y - y * step_x.z) + std::abs(step_y.y - y * step_y.z) + std::abs(step_z.y - y * step_z.z));
        // The image of a vector of length 1 at depth 1 is at most so long.
        const float ray_x = (std::abs(x - frame.middle_x) + half_x) * frame.inverse_focal;
        const float ray_y = (std::abs(y - frame.middle_y) + half_y) * frame.inverse_focal;
        const float stretch = std::sqrt(1 + ray_x * ray_x + ray_y * ray_y);
        const float radius = it.block == 0 ? stretch * largest : 0;
        const float splat = it.block == 0 ? radius * frame.focal * pixels : block;
        const float around = reach.across * stretch * frame.focal * pixels + splat + kPixelSlack + 0.5F;
        it.left = clamped(x - half_x - around, width);
        it.right = clamped(x + half_x + around + 1, width);
        it.top = std::max(it.top, clamped(y - half_y - around, height));
        it.bottom = std::min(it.bottom, clamped(y + half_y + around + 1, height));
        const float slope = 2 * reach.steepest * (it.block == 0 ? radius : block * farthest_pixel);
        it.nearest = std::max(nearest * (1 - kDepthSlack) - reach.forward * stretch - slope, 0.0F);
    }
}

} // namespace pbm
