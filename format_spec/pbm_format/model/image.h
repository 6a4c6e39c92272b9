// A raster in memory and its mip levels. BVG.md 3.10
#pragma once

#include "system/bytes.h"

#include <cstdint>

namespace pbm {

// Sides are powers of two, so that mip levels are exact. Panoramas are at most kMaxPanoramaWidth wide and half as high;
// rasters of the ground plane are squares of at most kMaxGroundRaster.
inline constexpr std::uint32_t kMaxPanoramaWidth = 16384;
inline constexpr std::uint32_t kMaxGroundRaster = 4096;

struct Image {
    std::uint32_t width = 0, height = 0;
    std::uint32_t channels = 1; // 1: values; 3: R, G, B, sRGB
    Bytes texels;               // [height][width][channels], top row first

    bool empty() const { return texels.empty(); }
    bool operator==(const Image &) const = default;
};

// Whether a file can hold a raster of this shape: 1 or 3 channels, powers of two, height <= width <= 2 x height, and
// width <= kMaxPanoramaWidth.
bool is_storable(std::uint32_t width, std::uint32_t height, std::uint32_t channels);

// Number of mip levels of a storable raster: from level 0, the raster itself, to the level of height 1.
int mip_levels(std::uint32_t height);

// The next mip level of a raster of height >= 2: each texel is the mean of 2x2. Three channels are averaged in linear
// light by the table of 6.3. One channel is averaged directly, even if it holds palette indices, because palettes are
// ramps. Normative: BVG.md 3.10.14
Image halved(const Image &finer);

} // namespace pbm
