#include "pbm_format/texel_filter.h"

#include <cassert>

namespace pbm {

namespace {

std::uint8_t zigzag(unsigned difference) {
    return static_cast<std::uint8_t>(difference << 1 ^ ((difference & 0x80) != 0 ? 0xFFU : 0U));
}

std::uint8_t unzigzag(std::uint8_t code) { return static_cast<std::uint8_t>(code >> 1 ^ (0U - (code & 1U))); }

using Texel = std::array<std::uint8_t, kMaxChannels>;

// What planes hold of a texel: channel 1 (or the only one), and the others less it.
Texel decorrelated(const std::uint8_t *texel, std::size_t channels) {
    if (channels == 1)
        return {texel[0]};
    return {texel[1], static_cast<std::uint8_t>(texel[0] - texel[1]), static_cast<std::uint8_t>(texel[2] - texel[1])};
}

} // namespace

std::vector<Bytes> filter_texels(ByteView texels, std::size_t width, std::size_t channels) {
    std::vector<Bytes> planes(channels, Bytes(texels.size() / channels));
    for (std::size_t i = 0; i < planes[0].size(); ++i) {
        const Texel here = decorrelated(&texels[i * channels], channels);
        Texel before{};
        if (i > 0) // the left neighbour; in the first column the one above
            before = decorrelated(&texels[(i % width != 0 ? i - 1 : i - width) * channels], channels);
        for (std::size_t c = 0; c < channels; ++c)
            planes[c][i] = zigzag(static_cast<unsigned>(here[c] - before[c]));
    }
    return planes;
}

void unfilter_texels(const TexelPlanes &planes, std::size_t width, std::size_t channels,
                     std::span<std::uint8_t> texels) {
    assert(channels == 1 || channels == 3);
    Texel first{}; // of the row
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
