// Pixels that get more samples than one, and those samples while they are drawn.
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/fine/surface_buffer.h"
#include "pbm_render/picture/framebuffer.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// A bit for each pixel of a picture.
class PixelBits {
  public:
    static constexpr int kBits = 64; // of a word

    // Keeps the words as they are: every row must be written.
    void resize(int width, int height) {
        words_ = static_cast<std::size_t>((width + kBits - 1) / kBits);
        bits_.resize(words_ * static_cast<std::size_t>(height));
    }
    void clear() { bits_.clear(); }
    bool empty() const { return bits_.empty(); }
    std::span<std::uint64_t> row(int y) {
        return std::span(bits_).subspan(static_cast<std::size_t>(y) * words_, words_);
    }
    std::span<const std::uint64_t> row(int y) const {
        return std::span(bits_).subspan(static_cast<std::size_t>(y) * words_, words_);
    }
    bool has(int x, int y) const {
        return (bits_[static_cast<std::size_t>(y) * words_ + static_cast<std::size_t>(x / kBits)] >> (x % kBits) & 1) !=
               0;
    }

  private:
    std::size_t words_ = 0;
    std::vector<std::uint64_t> bits_;
};

// Bits left .. right - 1 of a word of a row that begins with bit `start`.
constexpr std::uint64_t bits_between(int left, int right, int start) {
    std::uint64_t bits = ~std::uint64_t{0};
    if (left > start)
        bits &= ~std::uint64_t{0} << (left - start);
    if (right < start + PixelBits::kBits)
        bits &= ~(~std::uint64_t{0} << (right - start));
    return bits;
}

// Sets the bits within `distance` of those that are set, also behind the row's last pixel.
void widen(std::span<std::uint64_t> row, int distance);

// Calls visit(x) for the bits of a row that are set, in their order.
template <class Visit> void for_each_bit(std::span<const std::uint64_t> row, Visit &&visit) {
    for (std::size_t word = 0; word < row.size(); ++word)
        for (std::uint64_t bits = row[word]; bits != 0; bits &= bits - 1)
            visit(static_cast<int>(word) * PixelBits::kBits + std::countr_zero(bits));
}

// How many chosen pixels of a strip boxes of pixels hold: differences of the numbers above and left of their corners.
// Based on: Crow. Summed-Area Tables for Texture Mapping. 1984
class ChosenCounts {
  public:
    // Counts the chosen pixels of rows first .. end - 1, of `width` pixels each.
    void begin(const PixelBits &chosen, int width, int first, int end);
    const PixelBits &bits() const { return *bits_; }
    int width() const { return stride_ - 1; }
    int top() const { return top_; }
    int bottom() const { return bottom_; }
    // [rows + 1][stride()]: chosen pixels of the rows above and the columns left of a corner.
    const std::int32_t *above_left() const { return above_left_.data(); }
    int stride() const { return stride_; }
    // Whether a brick may touch chosen pixels.
    bool touch(const VisibleBrick &brick) const;

  private:
    const PixelBits *bits_ = nullptr;
    int stride_ = 1, top_ = 0, bottom_ = 0;
    std::vector<std::int32_t> above_left_;
};

// Several samples of each chosen pixel of some rows, side by side, so that a SIMD vector holds those of one pixel.
struct SampledPixels {
    static constexpr std::size_t kSamples = 8; // of a pixel at once
    static constexpr std::size_t kMaxPixels = 3072;

    struct Offsets {
        alignas(32) std::array<float, kSamples> x, y; // of the samples from the pixel's centre
    };

    // Starts with the chosen pixels from row `first` of a strip on, of as many rows as fit, at least one.
    void begin(const ChosenCounts &chosen, int first, std::size_t groups_of_pixel);
    // Drops the memory.
    void clear() { *this = {}; }
    // Finds the depth that hides a point at all samples of a pixel: `farthest_front`.
    void find_hiding_depths();
    // Splits the depths of `visible` into those of fronts and backs. Returns whether a sample shows a back.
    bool split_sides();

    // Calls visit(x, y, pixel) for the chosen pixels of columns left .. right - 1 of rows box_top .. box_bottom - 1, of
    // which there is at least one.
    template <class Visit>
    [[gnu::always_inline]] void for_each_in_box(int left, int right, int box_top, int box_bottom, Visit &&visit) const {
        constexpr std::size_t kBits = PixelBits::kBits;
        const std::size_t first_word = static_cast<std::size_t>(left) / kBits,
                          last_word = static_cast<std::size_t>(right - 1) / kBits;
        for (std::size_t word = first_word; word <= last_word; ++word) {
            const int start = static_cast<int>(word) * PixelBits::kBits;
            const std::uint64_t mask = bits_between(left, right, start), before = (mask & -mask) - 1;
            const std::uint64_t *row = bits->row(box_top).data() + word;
            const std::uint32_t *first = first_of.data() + static_cast<std::size_t>(box_top - top) * words + word;
            for (int y = box_top; y < box_bottom; ++y, row += words, first += words)
                if (std::uint64_t some = *row & mask; some != 0) {
                    std::size_t pixel = *first + static_cast<std::size_t>(std::popcount(*row & before));
                    for (; some != 0; some &= some - 1)
                        visit(start + std::countr_zero(some), y, pixel++);
                }
        }
    }

    const ChosenCounts *strip = nullptr;
    const PixelBits *bits = nullptr;
    int top = 0, bottom = 0;             // rows
    std::size_t count = 0;               // pixels
    std::size_t words = 0;               // of a row of bits
    std::size_t groups = 1;              // of a sample
    std::vector<std::uint32_t> first_of; // [rows][words]: the number of the first pixel
    std::vector<double> visible;         // [pixels][samples], see DepthStrip
    std::vector<float> depth;            // [pixels][samples] of visible fronts; +infinity: none
    std::vector<float> back_depth;       // likewise
    std::vector<float> farthest_front;   // [pixels] of `depth`, where there is one; -infinity: none
    std::vector<float> farthest_back;    // likewise
    std::vector<SurfaceGroup> sums;      // [pixels][groups * kGroupChannels], each holds one channel of all samples
};
static_assert(sizeof(SurfaceGroup) == SampledPixels::kSamples * sizeof(float));

} // namespace pbm
