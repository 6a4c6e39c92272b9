// Some rows of the picture while points are drawn into them: few enough to stay in the cache.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace pbm {

// A pixel is depth and point in one number: the bits of a positive float in the upper, the point's id in the lower
// half. The least of them is nearest, ties go to the lower id, and so the order of drawing does not matter. Read as a
// double, since that least is one instruction everywhere; positive floats never make a NaN of it.
struct DepthStrip {
    static constexpr int kMarginLeft = 1,
                         kMarginRight = 16; // columns beside the picture: room for blocks and whole SIMD vectors

    static constexpr double pixel(float depth, std::uint32_t id) {
        return std::bit_cast<double>(std::uint64_t{std::bit_cast<std::uint32_t>(depth)} << 32 | id);
    }

    // For rows first .. end - 1 of a picture; one more above and below may be drawn into.
    void begin(int picture_width, int first, int end) {
        width = picture_width;
        top = first;
        bottom = end;
        stride = picture_width + kMarginLeft + kMarginRight;
        constexpr float kNothing = std::numeric_limits<float>::infinity();
        pixels.assign(static_cast<std::size_t>(stride) * static_cast<std::size_t>(end - first + 2),
                      pixel(kNothing, 0xFFFFFFFF));
    }
    // Offset of a block that is part of no picture.
    int unseen() const { return stride - kMarginRight + 2; }
    std::ptrdiff_t offset(int x, int y) const { return std::ptrdiff_t{y - top + 1} * stride + x + kMarginLeft; }

    float depth(int x, int y) const { return std::bit_cast<float>(static_cast<std::uint32_t>(bits(x, y) >> 32)); }
    std::uint32_t id(int x, int y) const { return static_cast<std::uint32_t>(bits(x, y)); }
    std::uint64_t bits(int x, int y) const {
        return std::bit_cast<std::uint64_t>(pixels[static_cast<std::size_t>(offset(x, y))]);
    }

    int width = 0, top = 0, bottom = 0;
    int stride = 0; // pixels
    std::vector<double> pixels;
};

} // namespace pbm
