// The filter of tiles: texels as differences to the one on their left, green first. BVG.md 5.8.9
#pragma once

#include "system/bytes.h"

#include <array>
#include <vector>

namespace pbm {

inline constexpr std::size_t kMaxChannels = 3;
using TexelPlanes = std::array<ByteView, kMaxChannels>; // as many as there are channels, one byte per texel each

// Undoes filter_texels of raster_encoder.h: any bytes are differences. `width` texels a row.
void unfilter_texels(const TexelPlanes &planes, std::size_t width, std::size_t channels,
                     std::span<std::uint8_t> texels);

} // namespace pbm
