// A raster in memory. BVG.md section 3.10
#pragma once

#include "pbm_format/bytes.h"

#include <cstdint>

namespace pbm {

struct Image {
    std::uint32_t width = 0, height = 0;
    std::uint32_t channels = 1; // 1: values; 3: R, G, B, sRGB
    Bytes texels;               // [height][width][channels], top row first

    bool empty() const { return texels.empty(); }
    bool operator==(const Image &) const = default;
};

} // namespace pbm
