// The filter of tiles: texels as differences to the one on their left, green first. BVG.md 5.8.9
#pragma once

#include "pbm_format/bytes.h"

#include <array>
#include <vector>

namespace pbm {

inline constexpr std::size_t kMaxChannels = 3;
using TexelPlanes = std::array<ByteView, kMaxChannels>; // as many as there are channels, one byte per texel each

// Planes of the zigzags of differences: of the value for one channel; of G, R - G, B - G for three. `width` texels a
// row.
std::vector<Bytes> filter_texels(ByteView texels, std::size_t width, std::size_t channels);

// Undoes it: any bytes are differences.
void unfilter_texels(const TexelPlanes &planes, std::size_t width, std::size_t channels,
                     std::span<std::uint8_t> texels);

} // namespace pbm
