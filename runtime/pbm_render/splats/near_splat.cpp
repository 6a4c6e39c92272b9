#include "pbm_render/splats/near_splat.h"

#include "pbm_render/picture/framebuffer.h"
#include "pbm_render/splats/depth_strip.h"
#include "pbm_render/splats/splat.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace pbm {
namespace {

// Neighbouring discs meet at an angle, and close up each gap between them would be seen.
constexpr float kNearReach = 1.15F;

// Bounds of the pixels along one axis; a disc that reaches behind the eye is bounded on one side at most. `across`: of
// the centre.
std::array<int, 2> range_of(float across, float depth, float radius, float focal, float middle, int first, int end) {
    const float nearest = depth - radius, farthest = depth + radius, low = across - radius, high = across + radius;
    const auto pixel = [&](float value) {
        return static_cast<int>(std::clamp(middle + focal * value, static_cast<float>(first), static_cast<float>(end)));
    };
    const int lowest = low <= 0 && nearest <= 0 ? first : pixel(low / (low < 0 ? nearest : farthest)),
              highest = high >= 0 && nearest <= 0 ? end : pixel(high / (high > 0 ? nearest : farthest)) + 1;
    return {lowest, std::min(highest, end)};
}

} // namespace

PixelBox bounds_of(const NearSplat &splat, const FrameGeometry &frame, const PixelBox &picture) {
    const float x = splat.centre[0], y = splat.centre[1], depth = splat.centre[2], radius = kNearReach * splat.radius;
    const auto is_beside = [&](float across,
                               float middle) { // beyond the plane through the eye and the picture's border
        return frame.focal * std::abs(across) - middle * depth >
               radius * std::sqrt(frame.focal * frame.focal + middle * middle);
    };
    if (depth + radius <= 0 || is_beside(x, frame.middle_x) || is_beside(y, frame.middle_y))
        return {0, 0, 0, 0};
    const auto [left, right] = range_of(x, depth, radius, frame.focal, frame.middle_x, picture.left, picture.right);
    const auto [top, bottom] = range_of(y, depth, radius, frame.focal, frame.middle_y, picture.top, picture.bottom);
    return {left, right, top, bottom};
}

void find_depths(const NearSplat &splat, const FrameGeometry &frame, int y, int left, std::span<float> depths) {
    constexpr float kNothing = std::numeric_limits<float>::infinity();
    const auto [x0, y0, z0] = splat.centre;
    const auto [nx, ny, nz] = splat.normal;
    const float ray_y = (static_cast<float>(y) + 0.5F - frame.middle_y) * frame.inverse_focal;
    const float along = nx * x0 + ny * y0 + nz * z0, row = ny * ray_y + nz;
    const float first_x = (static_cast<float>(left) + 0.5F - frame.middle_x) * frame.inverse_focal;
    const float radius2 = splat.radius * splat.radius, max2 = kNearReach * kNearReach * radius2,
                cone = splat.cone / radius2;
    for (std::size_t i = 0; i < depths.size(); ++i) { // without branches: the compiler makes vectors of it
        const float ray_x = first_x + static_cast<float>(i) * frame.inverse_focal;
        const float depth = along / (nx * ray_x + row);
        const float x = depth * ray_x - x0, y1 = depth * ray_y - y0, z = depth - z0;
        const float distance2 = x * x + y1 * y1 + z * z;
        const bool is_seen = distance2 <= max2 && depth > 0; // false for depths that are no numbers
        depths[i] = is_seen ? depth + cone * distance2 : kNothing;
    }
}

void draw_near(std::span<const NearSplat> splats, const FrameGeometry &frame, DepthStrip &strip) {
    std::array<float, 64> depths;
    for (const NearSplat &splat : splats) {
        const PixelBox box = bounds_of(splat, frame, {0, strip.width, strip.top, strip.bottom});
        for (int y = box.top; y < box.bottom; ++y)
            for (int x = box.left; x < box.right; x += static_cast<int>(depths.size())) {
                const auto count = std::min(depths.size(), static_cast<std::size_t>(box.right - x));
                find_depths(splat, frame, y, x, std::span(depths).first(count));
                double *const pixels = strip.pixels.data() + strip.offset(x, y);
                for (std::size_t i = 0; i < count; ++i)
                    if (depths[i] < std::numeric_limits<float>::infinity())
                        pixels[i] = std::min(pixels[i], DepthStrip::pixel(depths[i], splat.id));
            }
    }
}

bool draw_near(const PointAroundEye &point, float voxel, bool shows_backs, const FrameGeometry &frame,
               Framebuffer &target) {
    const glm::vec3 &image = point.image;
    if (image.z <= -point.radius)
        return false;
    const auto [x, y, z, mean_inset] = frame.normals[static_cast<std::size_t>(point.normal & frame.normal_mask)];
    const glm::vec3 normal(x, y, z), centre((image.x - frame.middle_x * image.z) * frame.inverse_focal,
                                            (image.y - frame.middle_y * image.z) * frame.inverse_focal, image.z);
    const bool two_sided = (point.normal & kTwoSidedBit) != 0;
    const float facing = glm::dot(normal, centre);
    if ((!two_sided && !shows_backs && facing > kFacingSlack * glm::length(centre)) ||
        ((point.normal & kSideBit) != 0 && facing > kSideSlack * glm::length(centre)))
        return false;
    float inset = 0;
    if (!two_sided)
        inset = point.offset ? -*point.offset : mean_inset;
    const glm::vec3 middle = centre - inset * voxel * normal;
    const NearSplat splat{.centre = {middle.x, middle.y, middle.z},
                          .normal = {x, y, z},
                          .radius = point.radius,
                          .cone = kPlacedCone * voxel,
                          .id = point.id};
    const PixelBox box = bounds_of(splat, frame, {0, target.width, 0, target.height});
    if (box.left >= box.right)
        return false;
    std::vector<float> depths(static_cast<std::size_t>(box.right - box.left));
    for (int row = box.top; row < box.bottom; ++row) {
        find_depths(splat, frame, row, box.left, depths);
        const auto first = static_cast<std::size_t>(std::ptrdiff_t{row} * target.width + box.left);
        for (std::size_t i = 0; i < depths.size(); ++i)
            if (depths[i] < target.depth[first + i]) {
                target.depth[first + i] = depths[i];
                target.colour[first + i] = splat.id;
            }
    }
    return true;
}

} // namespace pbm
