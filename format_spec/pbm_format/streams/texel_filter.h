// Inverts the filter of tiles, which stores texels as differences to their left neighbours, green first. BVG.md 5.8.9
#pragma once

#include "system/bytes.h"

#include <array>
#include <vector>

namespace pbm {

inline constexpr std::size_t kMaxChannels = 3;
using TexelPlanes = std::array<ByteView, kMaxChannels>; // one per channel, one byte per texel

// Inverts filter_texels of raster_encoder.h; any bytes are valid differences. Rows have `width` texels.
void unfilter_texels(const TexelPlanes &planes, std::size_t width, std::size_t channels,
                     std::span<std::uint8_t> texels);

} // namespace pbm
