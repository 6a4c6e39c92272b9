// A finished strip as colours and depths: finds the pixels where something was drawn. SIMD (Highway).
#pragma once

#include "pbm_render/splats/depth_strip.h"

#include <cstdint>
#include <vector>

namespace pbm {

// Pixels of one row that show a point, from left to right.
struct CoveredPixels {
    explicit CoveredPixels(int width);

    std::size_t count = 0; // of the following, which have room behind for whole SIMD vectors
    std::vector<std::int32_t> x;
    std::vector<std::int32_t> id; // of the point
    std::vector<float> depth;     // grid edges
};

// Row `y` of the strip: writes `background` to all of `colours` and, unless it is null, the depths times `scale` to
// `depths` (+infinity stays), `strip.width` each, and lists the pixels that are covered.
void read_row(const DepthStrip &strip, int y, std::uint32_t background, float scale, std::uint32_t *colours,
              float *depths, CoveredPixels &covered);

} // namespace pbm
