#include "pbm_render/fine/sampled_pixels.h"

#include "pbm_render/bricks/point_ids.h"
#include "pbm_render/splats/depth_strip.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace pbm {

void widen(std::span<std::uint64_t> row, int distance) {
    std::uint64_t before = 0;
    for (std::size_t i = 0; i < row.size(); ++i) {
        const std::uint64_t here = row[i], next = i + 1 < row.size() ? row[i + 1] : 0;
        row[i] = here | here << distance | here >> distance | before >> (PixelBits::kBits - distance) |
                 next << (PixelBits::kBits - distance);
        before = here;
    }
}

void ChosenCounts::begin(const PixelBits &chosen, int width, int first, int end) {
    bits_ = &chosen;
    stride_ = width + 1;
    top_ = first;
    bottom_ = end;
    const auto stride = static_cast<std::size_t>(stride_);
    above_left_.resize(static_cast<std::size_t>(end - first + 1) * stride);
    std::fill_n(above_left_.begin(), stride, 0);
    for (int y = first; y < end; ++y) {
        const std::int32_t *const above = above_left_.data() + static_cast<std::size_t>(y - first) * stride;
        std::int32_t *const to = above_left_.data() + static_cast<std::size_t>(y - first + 1) * stride;
        std::int32_t left = 0;
        to[0] = 0;
        for (int x = 0; x < width; ++x) {
            left += chosen.has(x, y);
            to[x + 1] = above[x + 1] + left;
        }
    }
}

bool ChosenCounts::touch(const VisibleBrick &brick) const {
    const int left = std::max(brick.left - 1, 0), right = std::min(brick.right + 1, width());
    const int top = std::max(brick.top - 1, top_), bottom = std::min(brick.bottom + 1, bottom_);
    if (left >= right || top >= bottom)
        return false;
    const std::int32_t *const upper = above_left() + std::ptrdiff_t{top - top_} * stride_, *const lower =
                                                                                               above_left() +
                                                                                               std::ptrdiff_t{bottom -
                                                                                                              top_} *
                                                                                                   stride_;
    return lower[right] - upper[right] - lower[left] + upper[left] > 0;
}

void SampledPixels::begin(const ChosenCounts &chosen, int first, std::size_t groups_of_pixel) {
    strip = &chosen;
    bits = &chosen.bits();
    top = bottom = first;
    words = bits->row(first).size();
    groups = groups_of_pixel;
    count = 0;
    first_of.clear();
    for (; bottom < chosen.bottom(); ++bottom) {
        std::size_t pixels = count;
        for (const std::uint64_t word : bits->row(bottom)) {
            first_of.push_back(static_cast<std::uint32_t>(pixels));
            pixels += static_cast<std::size_t>(std::popcount(word));
        }
        if (pixels > kMaxPixels && bottom > first)
            break;
        count = pixels;
    }
    visible.assign(count * kSamples, DepthStrip::pixel(std::numeric_limits<float>::infinity(), DepthStrip::kNoId));
    depth.resize(visible.size());
    back_depth.resize(visible.size());
    sums.assign(count * groups * kGroupChannels, {});
}

void SampledPixels::find_hiding_depths() {
    farthest_front.resize(count);
    for (std::size_t pixel = 0; pixel < count; ++pixel) {
        float farthest = 0;
        for (std::size_t i = pixel * kSamples; i < (pixel + 1) * kSamples; ++i)
            farthest = std::max(farthest, DepthStrip::depth_of(visible[i]));
        farthest_front[pixel] = farthest;
    }
}

bool SampledPixels::split_sides() {
    constexpr float kNothing = std::numeric_limits<float>::infinity();
    farthest_front.assign(count, -kNothing);
    farthest_back.assign(count, -kNothing);
    bool any_back = false;
    for (std::size_t i = 0; i < visible.size(); ++i) {
        const float z = DepthStrip::depth_of(visible[i]);
        const bool is_back = z < kNothing && PointIds::is_back(DepthStrip::id_of(visible[i]));
        depth[i] = is_back ? kNothing : z;
        back_depth[i] = is_back ? z : kNothing;
        any_back |= is_back;
        if (z < kNothing) {
            float &farthest = (is_back ? farthest_back : farthest_front)[i / kSamples];
            farthest = std::max(farthest, z);
        }
    }
    return any_back;
}

} // namespace pbm
