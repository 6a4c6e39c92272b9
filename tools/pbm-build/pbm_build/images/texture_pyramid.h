// An image at all sizes, for means over parts of it.
// Based on: Williams. Pyramidal parametrics. 1983
#pragma once

#include "pbm_scan/surface/surface.h"

#include <array>
#include <cstdint>
#include <vector>

namespace pbm::build {

// Which texels of an image triangles show. Others are the background of an atlas, of any colour.
class TextureCoverage {
  public:
    explicit TextureCoverage(const Texture &texture)
        : width_(texture.width), height_(texture.height), wrap_(texture.use.wrap),
          covered_(std::size_t{width_} * height_, 0), spans_(height_, 0) {}

    // Adds all texels that a triangle touches, with half a texel around it. Safe to call from several threads.
    void add(const TextureCorners &corners);
    bool covers(std::size_t texel) const { return covered_[texel] != 0; }

  private:
    void mark(std::int64_t x0, std::int64_t x1, std::int64_t y);
    void mark_part(std::uint32_t row, std::uint32_t first, std::uint32_t last, std::uint32_t period);

    std::uint32_t width_, height_;
    std::array<Wrap, 2> wrap_;
    std::vector<std::uint8_t> covered_; // [height][width]
    // Triangles may show the image again and again: what is known to be covered is not marked once more.
    std::vector<std::uint64_t> spans_; // [height] a part of the row that is covered: first texel << 32 | end
    std::uint32_t full_rows_ = 0;
};

// The index of a texel of an image of `size` texels, which goes on as `wrap` says.
inline std::uint32_t wrapped(std::int64_t at, std::uint32_t size, Wrap wrap) {
    if (static_cast<std::uint64_t>(at) < size)
        return static_cast<std::uint32_t>(at);
    const auto n = static_cast<std::int64_t>(size);
    if (wrap == Wrap::clamp)
        return at < 0 ? 0 : size - 1;
    const std::int64_t period = wrap == Wrap::mirror ? 2 * n : n;
    const std::int64_t within = ((at % period) + period) % period;
    return static_cast<std::uint32_t>(within < n ? within : period - 1 - within);
}

// Level 0 is the image; each further one has half its size, rounded up. A texel is the mean, of colours in linear
// light, of those below it that are covered and cut no hole, or, where the vertices fade the image, weighted by their
// opacity.
class TexturePyramid {
  public:
    using Texel = std::array<std::uint8_t, 4>; // sRGB or numbers, and the share that is covered and shown: 0..255
    struct Level {
        std::uint32_t width = 0, height = 0;
        std::vector<Texel> texels;     // [height][width], top row first
        std::vector<std::uint8_t> cut; // share that is covered and not shown; empty: none is
        std::size_t index(std::int64_t x, std::int64_t y, const std::array<Wrap, 2> &wrap) const {
            return std::size_t{wrapped(y, height, wrap[1])} * width + wrapped(x, width, wrap[0]);
        }
    };

    TexturePyramid() = default;
    TexturePyramid(Texture texture, const TextureCoverage &coverage, int threads);

    const std::vector<Level> &levels() const { return levels_; }
    const std::array<Wrap, 2> &wrap() const { return use_.wrap; }
    bool is_tinted() const { return use_.is_tinted; }
    float relief() const { return use_.relief; }
    // [256] what texels stand for, 0..65,535: linear light, or numbers in proportion.
    const std::uint16_t *table() const { return table_; }
    bool is_faded() const { return use_.is_faded && use_.least_opacity > 0; }
    // A place is a hole if of what is covered there more than this, times what is shown, is not shown. `opacity`: of
    // the vertices, 0..1.
    double most_cut(double opacity) const {
        return is_faded() ? opacity / static_cast<double>(use_.least_opacity) - 1 : 1;
    }

  private:
    std::vector<Level> levels_;
    TextureUse use_{};
    const std::uint16_t *table_ = nullptr;
};

// For each image of `surface`.
std::vector<TextureCoverage> covered_texels(const Surface &surface, int threads);

// Takes the images out of `surface`.
std::vector<TexturePyramid> make_pyramids(Surface &surface, int threads);

} // namespace pbm::build
