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

namespace {

// Sets the bits of all rows within `distance` columns and rows of those that are set.
void widen_rows(std::vector<std::uint64_t> &rows, std::size_t words_of_row, std::size_t distance) {
    for (std::size_t i = 0; i < rows.size(); i += words_of_row)
        widen(std::span(rows).subspan(i, words_of_row), static_cast<int>(distance));
    const std::vector<std::uint64_t> narrow = rows;
    const std::size_t words = distance * words_of_row;
    for (std::size_t i = 0; i + words < rows.size(); ++i) {
        rows[i] |= narrow[i + words];
        rows[i + words] |= narrow[i];
    }
}

} // namespace

void NearPixels::begin(const PixelBits &chosen, int first, int end) {
    words_ = chosen.row(first).size();
    chosen_ = &chosen;
    top_ = first;
    bottom_ = end;
    const auto height = static_cast<std::size_t>(end - first), rows = height + 2 * kNear;
    last_column_ = static_cast<float>(words_) * PixelBits::kBits - 1;
    last_row_ = static_cast<float>(rows - 1);
    very_near_.assign(rows * words_, 0);
    for (std::size_t y = 0; y < height; ++y)
        std::copy_n(chosen.row(first + static_cast<int>(y)).data(), words_, very_near_.data() + (y + kNear) * words_);
    for (const std::size_t distance : {1U, 1U, 2U}) // kVeryNear together
        widen_rows(very_near_, words_, distance);
    near_ = very_near_;
    widen_rows(near_, words_, kNear - kVeryNear);
}

bool NearPixels::touch(const VisibleBrick &brick) const {
    const int left = std::max(brick.left - 1, 0), right = std::min(brick.right + 1, static_cast<int>(last_column_) + 1);
    if (left >= right)
        return false;
    for (int y = std::max(brick.top - 1, top_); y < std::min(brick.bottom + 1, bottom_); ++y) {
        const std::span<const std::uint64_t> row = chosen_->row(y);
        for (int word = left / PixelBits::kBits; word <= (right - 1) / PixelBits::kBits; ++word)
            if ((row[static_cast<std::size_t>(word)] & bits_between(left, right, word * PixelBits::kBits)) != 0)
                return true;
    }
    return false;
}

void SampledPixels::begin(const PixelBits &chosen, int first, int end, std::size_t groups_of_pixel) {
    bits = &chosen;
    top = bottom = first;
    words = chosen.row(first).size();
    groups = groups_of_pixel;
    count = 0;
    first_of.clear();
    for (; bottom < end; ++bottom) {
        std::size_t pixels = count;
        for (const std::uint64_t word : chosen.row(bottom)) {
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
