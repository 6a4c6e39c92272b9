// Rows of the picture into which splats are blended, few enough to stay in the cache.
#pragma once

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
//   group 2   lit fractions of lights 4 to 7; unused
inline constexpr std::size_t kGroupChannels = 8, kMaxGroups = 3;
namespace channel {
inline constexpr std::size_t kNormal = 0, kWeight = 3, kColour = 4, kEnvironment = 7, kPhong = 8, kLit = 12;
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

    // Starts with the depths of a strip.
    void begin(const DepthStrip &strip, std::size_t groups_of_pixel) {
        width = strip.width;
        top = strip.top;
        bottom = strip.bottom;
        stride = width + kMarginRight;
        groups = groups_of_pixel;
        const auto rows = static_cast<std::size_t>(bottom) - static_cast<std::size_t>(top) + kMarginBottom;
        depth.assign(static_cast<std::size_t>(stride) * rows, std::numeric_limits<float>::infinity());
        show(strip, [](std::uint32_t) { return true; });
        sums.assign(depth.size() * groups, {});
    }
    // Takes the depths of the pixels whose ids `is_shown` accepts; the others show no surface.
    template <class IsShown> void show(const DepthStrip &strip, IsShown &&is_shown) {
        for (int y = top; y < bottom; ++y)
            for (int x = 0; x < width; ++x)
                depth[offset(x, y)] =
                    is_shown(strip.id(x, y)) ? strip.depth(x, y) : std::numeric_limits<float>::infinity();
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
    std::vector<SurfaceGroup> sums; // [rows][stride][groups]
};

} // namespace pbm
