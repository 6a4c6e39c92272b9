#include "pbm_render/bricks/brick_culling.h"

#include "pbm_surface/surface_offsets.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm {
namespace {

constexpr float kBrickVoxels = 8;
// The bounds below do not hold for eyes nearer than this many times the brick's reach: such bricks are not culled.
constexpr float kNear = 8;
// Blocks of points up to this fraction of their edge apart leave no gap, at any angle.
constexpr float kBlockRoom = 0.8F;
// Blocks of splats that are smaller by this factor leave no gap without redundant points.
constexpr float kThinRoom = 1.12F;
// Grid edges. Floats hold the places of bricks relative to eyes up to this far from the cube, else to its middle.
constexpr float kFarEye = 100;
// Pixels. Voxels up to this width are drawn as blocks of 2 x 2 pixels or as ellipses.
constexpr float kSmallVoxel = 1.42F;

// Whether no normal of the cone faces the eye anywhere in the brick. `sight`: from the eye to the brick's centre;
// `along`: its product with the cone's axis, positive; `reach`: the brick's radius; all in eye space.
bool faces_away(const BrickRecord &brick, glm::vec3 sight, float along, float reach) {
    const float inverse_length = 1 / glm::length(sight);
    const float cosine = static_cast<float>(brick.cone_cosine) / 32767.0F;
    along *= inverse_length;
    const float sines = std::sqrt(std::max(0.0F, (1 - cosine * cosine) * (1 - along * along)));
    // The reference's slack refers to rays of depth 1, which are at least as long as the unit ray here.
    return along * cosine - sines > kFacingSlack + reach * inverse_length;
}

} // namespace

RunGeometry::RunGeometry(const PointRun &points, const FrameGeometry &frame)
    : run(&points), voxel(std::ldexp(1.0F, -points.level)),
      max_offset(points.offsets == nullptr ? 0 : kMaxOffset * voxel) {
    const double edge = std::ldexp(1.0, -points.level);
    steps = {glm::vec3(frame.projection.vector({edge, 0, 0})), glm::vec3(frame.projection.vector({0, edge, 0})),
             glm::vec3(frame.projection.vector({0, 0, edge}))};
}

std::size_t find_seen_bricks(const RunGeometry &geometry, const FrameGeometry &frame, std::span<SeenBrick> to) {
    const PointRun &run = *geometry.run;
    const std::span<const BrickRecord> bricks = run.chunk->bricks;
    const EyeAxes &axes = frame.projection.axes;
    const auto right = glm::vec3(axes.right), down = glm::vec3(-axes.up), forward = glm::vec3(axes.forward);
    const glm::dvec3 to_cube = glm::dvec3(0.5) - frame.projection.eye;
    const bool is_far = glm::length(to_cube) > static_cast<double>(kFarEye);
    const auto origin = is_far ? glm::vec3(0.5F) : glm::vec3(frame.projection.eye);
    const auto to_origin =
        is_far ? glm::vec3(glm::dot(to_cube, axes.right), -glm::dot(to_cube, axes.up), glm::dot(to_cube, axes.forward))
               : glm::vec3(0);
    const float voxel = geometry.voxel, half = kBrickVoxels / 2 * voxel;
    const float half_diagonal = half * std::sqrt(3.0F);
    const float to_first = -(kBrickVoxels - 1) / 2;
    const glm::vec3 first = to_first * (geometry.steps[0] + geometry.steps[1] + geometry.steps[2]);
    const auto height = static_cast<float>(frame.height);
    const HalfSpaces &clip = frame.projection.clip;
    std::size_t seen = 0;
    for (std::size_t i = 0; i < bricks.size(); ++i) {
        const BrickRecord &brick = bricks[i];
        const std::uint32_t end = i + 1 < bricks.size() ? bricks[i + 1].first_point : run.last;
        if (brick.first_point >= run.last || end <= run.first)
            continue;
        const glm::vec3 sight =
            glm::vec3(static_cast<float>(brick.x), static_cast<float>(brick.y), static_cast<float>(brick.z)) *
                (2 * half) +
            half - origin;
        const glm::vec3 centre =
            glm::vec3(glm::dot(sight, right), glm::dot(sight, down), glm::dot(sight, forward)) + to_origin;
        const float radius = frame.radii[brick.largest_radius];
        const float reach = half_diagonal + radius + geometry.max_offset;
        if (centre.z + reach <= 0)
            continue;
        const float nearest = centre.z - reach;
        const HalfSpaces::Side side =
            clip.empty() ? HalfSpaces::Side::inside
                         : clip.side_of(glm::dvec3(sight + origin), glm::dvec3(static_cast<double>(half)));
        if (side == HalfSpaces::Side::outside)
            continue;
        SeenBrick &it = to[seen];
        it.is_cut = side == HalfSpaces::Side::cut;
        it.block = 0;
        it.faces_eye = true;
        it.thin = false;
        it.top = 0;
        it.bottom = frame.height;
        it.left = 0;
        it.right = frame.width;
        it.nearest = 0;
        if (nearest > kNear * reach) {
            const float inverse = frame.focal / centre.z, extent = reach * frame.focal / nearest;
            const float x = centre.x * inverse, y = centre.y * inverse;
            const float reach_x = extent * (1 + std::abs(x) * frame.inverse_focal) + 2;
            const float reach_y = extent * (1 + std::abs(y) * frame.inverse_focal) + 2;
            if (std::abs(x) > reach_x + frame.middle_x || std::abs(y) > reach_y + frame.middle_y)
                continue;
            it.faces_eye = !clip.empty();
            if (brick.cone_cosine != kNoCone && clip.empty()) {
                const EyeNormal &axis = frame.normals[brick.cone_axis & kNormalIndexMask];
                const float along = axis.x * centre.x + axis.y * centre.y + axis.z * centre.z;
                it.faces_eye = along <= 0;
                if (along > 0 && faces_away(brick, centre, along, reach))
                    continue;
            }
            // Off the picture's middle, a length across the ray covers more pixels; blocks leave some room for that.
            const float stretch = std::sqrt(1 + (x * x + y * y) * frame.inverse_focal * frame.inverse_focal);
            const float pixels = radius * frame.focal;
            const bool is_small = voxel * frame.focal <= kSmallVoxel * centre.z;
            const std::uint8_t edge = is_small ? 2 : run.max_block;
            const float largest = kBlockRadius * static_cast<float>(edge) * nearest;
            it.block = pixels * std::max(1.0F, kBlockRoom * stretch) > largest ? 0 : edge;
            it.thin = pixels * kThinRoom * stretch <= largest && !it.is_cut;
            it.top = static_cast<std::int32_t>(std::max(y + frame.middle_y - reach_y, 0.0F));
            it.bottom = static_cast<std::int32_t>(std::min(y + frame.middle_y + reach_y + 1, height));
        }
        it.u = frame.focal * centre.x + frame.middle_x * centre.z + first.x;
        it.v = frame.focal * centre.y + frame.middle_y * centre.z + first.y;
        it.w = centre.z + first.z;
        it.brick = static_cast<std::uint32_t>(i);
        seen += it.top < it.bottom;
    }
    return seen;
}

} // namespace pbm
