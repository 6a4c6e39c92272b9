#include "pbm_bake/shadow_rays.h"

#include "pbm_bake/light_view.h"
#include "pbm_surface/carried_offsets.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

namespace pbm {
namespace {

constexpr float kRayOffsetSteps = 127; // of a voxel
constexpr float kLayerSteps = 64;      // the same
constexpr float kFarthestLayer = 2;    // voxels: splats of farther layers do not show through
constexpr float kBelow = 0.05F;        // a ray starts this far below a position to meet the triangle there
constexpr float kFarthestPlace = 0.9F; // half of a voxel's diagonal, plus rounding
constexpr float kReachSlack = 1e-3F;   // voxels
// Rounding cannot decide the side of a light at the horizon: within this cosine a point faces it.
constexpr float kMinCosine = 1e-4F;
// A point on which this many parts of a light agree lies outside of the penumbra.
constexpr std::size_t kFirstParts = 8;
constexpr std::size_t kBricksAtOnce = 16;

float dot(const Position &a, const Position &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Position raised(const Position &from, const Position &normal, float lift) {
    return {from[0] + lift * normal[0], from[1] + lift * normal[1], from[2] + lift * normal[2]};
}

struct Way {
    Position direction; // unit length
    float length;
};

Way way_to(const LightPlace &light, const Position &from) {
    Vector3 way{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        way[axis] = light.parallel ? -light.direction[axis] : light.position[axis] - static_cast<double>(from[axis]);
    const double length = std::sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
    const double scale = length > 0 ? 1 / length : 0; // length 0: nothing is between
    return {
        {static_cast<float>(way[0] * scale), static_cast<float>(way[1] * scale), static_cast<float>(way[2] * scale)},
        light.parallel ? std::numeric_limits<float>::max() : static_cast<float>(length)};
}

Position centre_of(const LevelBrick &brick, std::uint16_t place) {
    const Vector3 centre = voxel_centre(brick, place);
    return {static_cast<float>(centre[0]), static_cast<float>(centre[1]), static_cast<float>(centre[2])};
}

Position unit_normal(std::uint16_t stored) {
    const UnitVector &n = normal_table()[stored & kNormalIndexMask];
    return {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])};
}

// Height of the outermost layer above a position on a triangle, in kLayerSteps-ths of a voxel.
std::uint8_t layers_above(const TriangleTree &triangles, const Position &place, std::uint16_t stored) {
    if ((stored & kTwoSidedBit) != 0) // the outer side is unknown
        return 0;
    const Position normal = unit_normal(stored);
    const std::optional<float> last =
        triangles.last_layer(raised(place, normal, -kBelow), normal, 2 * kBelow, kBelow + kFarthestLayer);
    return static_cast<std::uint8_t>(std::max(last.value_or(0) - kBelow, 0.0F) * kLayerSteps + 0.5F);
}

std::int8_t quantise(float offset) {
    return static_cast<std::int8_t>(std::clamp(std::floor(offset * kRayOffsetSteps + 0.5F), -127.0F, 127.0F));
}

} // namespace

ShadowRays::ShadowRays(const ShadowCasters &casters, const TriangleTree &triangles, int threads, float lift)
    : casters_(casters), triangles_(triangles), lift_(lift), offsets_(casters.size()) {
    const auto bricks = casters.bricks();
    const std::size_t count = bricks.size() - 1;
    std::atomic<bool> complete = !triangles.empty();
    parallel_for((count + kBricksAtOnce - 1) / kBricksAtOnce, threads, [&](std::size_t block) {
        for (std::size_t b = block * kBricksAtOnce; b < std::min(count, (block + 1) * kBricksAtOnce) && complete; ++b) {
            Position last{};
            bool known = false;
            for (std::size_t i = bricks[b].first_point; i < bricks[b + 1].first_point; ++i) {
                const Position centre = centre_of(bricks[b], casters.places()[i]);
                // The surface position of the previous point bounds the search.
                const Position way{last[0] - centre[0], last[1] - centre[1], last[2] - centre[2]};
                const float within =
                    known ? std::min(kFarthestPlace, std::sqrt(dot(way, way)) + kReachSlack) : kFarthestPlace;
                const std::optional<Position> found = triangles.nearest(centre, within);
                if (!found) {
                    complete = false;
                    break;
                }
                last = *found;
                known = true;
                offsets_[i] = {quantise(last[0] - centre[0]), quantise(last[1] - centre[1]),
                               quantise(last[2] - centre[2]), layers_above(triangles, last, casters.normals()[i])};
            }
        }
    });
    complete_ = complete;
}

std::size_t ShadowRays::blocks() const { return (casters_.bricks().size() - 1 + kBricksAtOnce - 1) / kBricksAtOnce; }

bool ShadowRays::reached(const Start &from, const LightPlace &light) const {
    const Way way = way_to(light, from.front);
    const bool away = dot(from.normal, way.direction) < -kMinCosine;
    if (away && !from.two_sides)
        return false;
    const Position start = away ? raised(from.back, from.normal, -lift_) : raised(from.front, from.normal, lift_);
    const Way rest = way_to(light, start);
    return !triangles_.blocks(start, rest.direction, rest.length);
}

void ShadowRays::vote(std::size_t block, std::span<const LightPlace> parts, std::span<std::uint8_t> votes) const {
    const auto bricks = casters_.bricks();
    const std::size_t end = std::min(bricks.size() - 1, (block + 1) * kBricksAtOnce);
    for (std::size_t b = block * kBricksAtOnce; b < end; ++b)
        for (std::size_t i = bricks[b].first_point; i < bricks[b + 1].first_point; ++i) {
            const Position centre = centre_of(bricks[b], casters_.places()[i]);
            const Position place{centre[0] + static_cast<float>(offsets_[i].x) / kRayOffsetSteps,
                                 centre[1] + static_cast<float>(offsets_[i].y) / kRayOffsetSteps,
                                 centre[2] + static_cast<float>(offsets_[i].z) / kRayOffsetSteps};
            const Position normal = unit_normal(casters_.normals()[i]);
            const Start start{raised(place, normal, static_cast<float>(offsets_[i].layers) / kLayerSteps), place,
                              normal, casters_.has_two_sides(i)};
            std::size_t asked = 0, lit = 0;
            for (const LightPlace &part : parts) {
                if (asked == kFirstParts && (lit == 0 || lit == asked))
                    break;
                lit += reached(start, part) ? 1 : 0;
                ++asked;
            }
            votes[i] = static_cast<std::uint8_t>(lit == asked ? parts.size() : lit);
        }
}

} // namespace pbm
