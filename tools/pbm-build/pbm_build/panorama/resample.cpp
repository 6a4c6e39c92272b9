#include "pbm_build/panorama/resample.h"

#include "pbm_format/model/point_values.h"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace pbm::build {

PanoramaResampler::PanoramaResampler(std::uint32_t from_width, std::uint32_t from_height, std::uint32_t width,
                                     std::uint32_t height)
    : from_width_(from_width), from_height_(from_height), columns_(tent(from_width, width)),
      rows_(tent(from_height, height)), narrow_(std::size_t{width} * 3),
      srgb_(65536), image_{.width = width, .height = height, .channels = 3, .texels = {}} {
    for (std::uint32_t linear = 0; linear < srgb_.size(); ++linear)
        srgb_[linear] = linear_to_srgb(linear);
    image_.texels.reserve(std::size_t{width} * height * 3);
}

// Positions in units of half a texel of both rasters: centres of the source at (2 j + 1) x to, of the result at
// (2 i + 1) x from.
std::vector<PanoramaResampler::Taps> PanoramaResampler::tent(std::uint32_t from, std::uint32_t to) {
    constexpr std::int64_t kOne = 1 << 16;
    const std::int64_t reach = 2 * std::int64_t{std::max(from, to)};
    std::vector<Taps> taps(to);
    for (std::int64_t i = 0; i < to; ++i) {
        const std::int64_t centre = (2 * i + 1) * from;
        std::int64_t j = (centre - reach) / (2 * std::int64_t{to}) - 1;
        while ((2 * j + 1) * to <= centre - reach)
            ++j;
        taps[static_cast<std::size_t>(i)].first = j;
        std::vector<std::int64_t> heights;
        for (; (2 * j + 1) * to < centre + reach; ++j)
            heights.push_back(reach - std::abs((2 * j + 1) * to - centre));
        const std::int64_t sum = std::accumulate(heights.begin(), heights.end(), std::int64_t{0});
        std::int64_t left = kOne;
        auto &weights = taps[static_cast<std::size_t>(i)].weights;
        for (const std::int64_t height : heights) {
            weights.push_back(static_cast<std::uint32_t>(height * kOne / sum));
            left -= weights.back();
        }
        *std::max_element(weights.begin(), weights.end()) += static_cast<std::uint32_t>(left); // what rounding took
    }
    return taps;
}

void PanoramaResampler::resample_row(std::span<const std::uint16_t> row) {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
        std::array<std::uint64_t, 3> sum{};
        std::int64_t j = columns_[i].first;
        for (const std::uint32_t weight : columns_[i].weights) {
            const std::int64_t at = (j++ + 2 * std::int64_t{from_width_}) % from_width_;
            for (std::size_t c = 0; c < 3; ++c)
                sum[c] += std::uint64_t{weight} * row[3 * static_cast<std::size_t>(at) + c];
        }
        for (std::size_t c = 0; c < 3; ++c)
            narrow_[3 * i + c] = static_cast<std::uint32_t>((sum[c] + (1U << 15)) >> 16);
    }
}

void PanoramaResampler::emit_row(std::span<const std::uint64_t> sums) {
    for (const std::uint64_t sum : sums)
        image_.texels.push_back(srgb_[static_cast<std::size_t>((sum + (1U << 15)) >> 16)]);
}

void PanoramaResampler::add_row(std::span<const std::uint16_t> row) {
    assert(row.size() == std::size_t{from_width_} * 3 && next_row_ < from_height_);
    resample_row(row);
    // The first and last rows also stand for the rows outside of the source.
    const std::int64_t low = next_row_ == 0 ? -std::int64_t{1 << 20} : next_row_;
    const std::int64_t high = next_row_ + 1 == from_height_ ? std::int64_t{1} << 20 : next_row_;
    for (std::size_t i = first_open_; i < rows_.size() && rows_[i].first <= high; ++i) {
        if (i - first_open_ == open_.size())
            open_.emplace_back(narrow_.size(), 0);
        const Taps &taps = rows_[i];
        std::uint64_t weight = 0;
        for (std::size_t k = 0; k < taps.weights.size(); ++k)
            if (const std::int64_t j = taps.first + static_cast<std::int64_t>(k); j >= low && j <= high)
                weight += taps.weights[k];
        std::vector<std::uint64_t> &sums = open_[i - first_open_];
        for (std::size_t k = 0; k < narrow_.size(); ++k)
            sums[k] += weight * narrow_[k];
    }
    while (!open_.empty() &&
           rows_[first_open_].first + static_cast<std::int64_t>(rows_[first_open_].weights.size()) - 1 <= high) {
        emit_row(open_.front());
        open_.pop_front();
        ++first_open_;
    }
    ++next_row_;
}

Image PanoramaResampler::finish() {
    assert(next_row_ == from_height_ && first_open_ == rows_.size());
    return std::move(image_);
}

} // namespace pbm::build
