#include "pbm_format/streams/texel_filter.h"

#include <cassert>

namespace pbm {

namespace {

std::uint8_t unzigzag(std::uint8_t code) { return static_cast<std::uint8_t>(code >> 1 ^ (0U - (code & 1U))); }

using Texel = std::array<std::uint8_t, kMaxChannels>;

} // namespace

void unfilter_texels(const TexelPlanes &planes, std::size_t width, std::size_t channels,
                     std::span<std::uint8_t> texels) {
    assert(channels == 1 || channels == 3);
    Texel first{}; // of the current row
    std::uint8_t *to = texels.data();
    for (std::size_t row = 0; row * width * channels < texels.size(); ++row) {
        Texel sum = first;
        const std::size_t start = row * width;
        if (channels == 1)
            for (std::size_t x = 0; x < width; ++x)
                *to++ = sum[0] = static_cast<std::uint8_t>(sum[0] + unzigzag(planes[0][start + x]));
        else
            for (std::size_t x = 0; x < width; ++x, to += 3) {
                for (std::size_t c = 0; c < 3; ++c)
                    sum[c] = static_cast<std::uint8_t>(sum[c] + unzigzag(planes[c][start + x]));
                to[0] = static_cast<std::uint8_t>(sum[1] + sum[0]);
                to[1] = sum[0];
                to[2] = static_cast<std::uint8_t>(sum[2] + sum[0]);
            }
        for (std::size_t c = 0; c < channels; ++c)
            first[c] = static_cast<std::uint8_t>(first[c] + unzigzag(planes[c][start]));
    }
}

} // namespace pbm
