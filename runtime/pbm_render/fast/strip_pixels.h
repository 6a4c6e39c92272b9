// Reads a finished strip: writes its depths and lists the pixels that show a point. SIMD (Highway).
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "pbm_render/splats/depth_strip.h"

#include <cstdint>
#include <vector>

namespace pbm {

// Pixels of one row that show a point, from left to right.
struct CoveredPixels {
    explicit CoveredPixels(int width);

    std::size_t count = 0; // entries; the arrays are padded for whole SIMD vectors
    std::vector<std::int32_t> x;
    std::vector<std::int32_t> id; // of the point
    std::vector<float> depth;     // grid edges
};

// Fills the colours of `to`, row `y` of the strip, with `background`, writes its depths if `to` has them (+infinity
// stays +infinity), and lists in `covered` the pixels that show a point, whose colours are still to come.
void write_row(const DepthStrip &strip, int y, std::uint32_t background, const PixelRow &to, CoveredPixels &covered);

} // namespace pbm
