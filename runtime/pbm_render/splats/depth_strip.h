// A strip of the picture into which points are drawn, with few enough rows to stay in the cache.
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/bricks/frame_geometry.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace pbm {

// A pixel holds depth and point in one number: the bits of a positive float in the upper half, the point's id in the
// lower half. The smallest number is the nearest point, and the lower id wins a tie, so the order of drawing does not
// matter. It is stored as a double (never a NaN), since the minimum of doubles is one instruction on every target.
struct DepthStrip {
    // Rows above and below the strip, and columns beside the picture: for blocks and whole SIMD vectors.
    static constexpr int kMarginRows = 2, kMarginLeft = 2, kMarginRight = 16;

    static constexpr std::uint32_t kNoId = 0xFFFFFFFF; // of pixels that show nothing

    static constexpr double pixel(float depth, std::uint32_t id) {
        return std::bit_cast<double>(std::uint64_t{std::bit_cast<std::uint32_t>(depth)} << 32 | id);
    }
    static constexpr float depth_of(double pixel) {
        return std::bit_cast<float>(static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(pixel) >> 32));
    }
    static constexpr std::uint32_t id_of(double pixel) {
        return static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(pixel));
    }

    // Clears the strip for rows first .. end - 1 of a picture.
    void begin(int picture_width, int first, int end) {
        width = picture_width;
        top = first;
        bottom = end;
        stride = picture_width + kMarginLeft + kMarginRight;
        constexpr float kNothing = std::numeric_limits<float>::infinity();
        pixels.assign(static_cast<std::size_t>(stride) * static_cast<std::size_t>(end - first + 2 * kMarginRows),
                      pixel(kNothing, kNoId));
    }
    // Offset of an unused block outside the picture.
    int unseen() const { return stride - kMarginRight + 2; }
    std::ptrdiff_t offset(int x, int y) const {
        return std::ptrdiff_t{y - top + kMarginRows} * stride + x + kMarginLeft;
    }

    float depth(int x, int y) const { return depth_of(pixels[static_cast<std::size_t>(offset(x, y))]); }
    std::uint32_t id(int x, int y) const { return id_of(pixels[static_cast<std::size_t>(offset(x, y))]); }

    int width = 0, top = 0, bottom = 0;
    int stride = 0; // pixels
    std::vector<double> pixels;
};

// A run, the strip that it is drawn into, and the frame.
struct StripRun {
    const FrameGeometry &frame;
    const RunGeometry &run;
    const DepthStrip &strip;
};

} // namespace pbm
