#include "pbm_format/model/model.h"

#include "pbm_format/model/point_values.h"

#include <array>
#include <bit>
#include <cassert>

namespace pbm {

bool is_storable(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
    return (channels == 1 || channels == 3) && std::has_single_bit(width) && std::has_single_bit(height) &&
           width <= kMaxPanoramaWidth && height <= width && width / 2 <= height;
}

int mip_levels(std::uint32_t height) { return static_cast<int>(std::bit_width(height)); }

namespace {

// Sum of `value` over the four texels of channel `c` at (2x, 2y).
template <class Value>
std::uint32_t sum_of_four(const Image &finer, std::uint32_t x, std::uint32_t y, std::uint32_t c, Value &&value) {
    const std::size_t row = std::size_t{finer.width} * finer.channels;
    const std::uint8_t *at = finer.texels.data() + 2 * y * row + std::size_t{2} * x * finer.channels + c;
    return std::uint32_t{value(at[0])} + value(at[finer.channels]) + value(at[row]) + value(at[row + finer.channels]);
}

} // namespace

Image halved(const Image &finer) {
    assert(finer.height >= 2 && is_storable(finer.width, finer.height, finer.channels));
    const std::span<const std::uint16_t> linear = linear_table();
    Image coarser{.width = finer.width / 2, .height = finer.height / 2, .channels = finer.channels, .texels = {}};
    coarser.texels.resize(finer.texels.size() / 4);
    std::size_t at = 0;
    for (std::uint32_t y = 0; y < coarser.height; ++y)
        for (std::uint32_t x = 0; x < coarser.width; ++x) {
            if (finer.channels == 1) {
                const std::uint32_t sum = sum_of_four(finer, x, y, 0, [](std::uint8_t v) { return v; });
                coarser.texels[at++] = static_cast<std::uint8_t>((sum + 2) / 4);
                continue;
            }
            for (std::uint32_t c = 0; c < 3; ++c) {
                const std::uint32_t sum = sum_of_four(finer, x, y, c, [&](std::uint8_t v) { return linear[v]; });
                coarser.texels[at++] = linear_to_srgb((sum + 2) / 4);
            }
        }
    return coarser;
}

} // namespace pbm
