// Rows of the picture into which splats are blended, few enough to stay in the cache.
#pragma once

#include "pbm_render/bricks/point_ids.h"
#include "pbm_render/splats/depth_strip.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <new>
#include <vector>

namespace pbm {

// What a point adds to a pixel, times its weight; a pixel holds the sums. Each group is as wide as a SIMD vector;
// groups that the model does not need are left out.
//
//   group 0   normal x, y, z (eye space), 1; colour red, green, blue (linear), environment factor
//   group 1   ka, kd, ks, power; lit fractions of lights 0 to 3
//   group 2   lit fractions of lights 4 to 7; environment factor x tint; unused
inline constexpr std::size_t kGroupChannels = 8, kMaxGroups = 3;
namespace channel {
inline constexpr std::size_t kNormal = 0, kWeight = 3, kColour = 4, kEnvironment = 7, kPhong = 8, kLit = 12, kTint = 20;
}

struct SurfacePoint {
    alignas(32) std::array<float, kMaxGroups * kGroupChannels> channels;
};

struct alignas(32) SurfaceGroup {
    std::array<float, kGroupChannels> channels;
};

struct SurfaceBuffer {
    // Empty columns and rows beside the picture, for whole SIMD vectors.
    static constexpr int kMarginRight = 16, kMarginBottom = 3;

    // Starts with the depths of a strip. `has_backs`: whether the strip may show backs; their depths are kept apart.
    void begin(const DepthStrip &strip, std::size_t groups_of_pixel, bool has_backs) {
        width = strip.width;
        top = strip.top;
        bottom = strip.bottom;
        stride = width + kMarginRight;
        groups = groups_of_pixel;
        const auto rows = static_cast<std::size_t>(bottom) - static_cast<std::size_t>(top) + kMarginBottom;
        depth.assign(static_cast<std::size_t>(stride) * rows, std::numeric_limits<float>::infinity());
        back_depth.assign(has_backs ? depth.size() : 0, std::numeric_limits<float>::infinity());
        for (int y = top; y < bottom; ++y) {
            float *const to = depth.data() + offset(0, y);
            if (has_backs)
                copy_sides(strip, y, to, back_depth.data() + offset(0, y));
            else
                for (int x = 0; x < width; ++x)
                    to[x] = strip.depth(x, y);
        }
        sums.assign(depth.size() * groups, {});
    }
    // Whether a pixel shows a back.
    bool shows_backs() const {
        return std::any_of(back_depth.begin(), back_depth.end(),
                           [](float z) { return z < std::numeric_limits<float>::infinity(); });
    }
    // Exchanges the surface of the pixels that show fronts with that of those that show backs.
    void swap_sides() { depth.swap(back_depth); }
    void join_sides() {
        std::transform(depth.begin(), depth.end(), back_depth.begin(), depth.begin(),
                       [](float a, float b) { return std::min(a, b); });
    }
    std::size_t offset(int x, int y) const {
        return static_cast<std::size_t>(y - top) * static_cast<std::size_t>(stride) + static_cast<std::size_t>(x);
    }
    SurfaceGroup *sums_of(std::size_t offset_of_pixel) { return sums.data() + offset_of_pixel * groups; }
    const SurfaceGroup *sums_of(std::size_t offset_of_pixel) const { return sums.data() + offset_of_pixel * groups; }

    int width = 0, top = 0, bottom = 0;
    int stride = 0;                 // pixels
    std::size_t groups = 1;         // per pixel
    std::vector<float> depth;       // [rows][stride] of the visible surface, grid edges; +infinity: no surface
    std::vector<float> back_depth;  // likewise, where it is a back
    std::vector<SurfaceGroup> sums; // [rows][stride][groups]

  private:
    void copy_sides(const DepthStrip &strip, int y, float *fronts, float *backs) const {
        for (int x = 0; x < width; ++x) {
            const float z = strip.depth(x, y);
            const bool is_back = PointIds::is_back(strip.id(x, y));
            fronts[x] = is_back ? std::numeric_limits<float>::infinity() : z;
            backs[x] = is_back ? z : std::numeric_limits<float>::infinity();
        }
    }
};

} // namespace pbm
