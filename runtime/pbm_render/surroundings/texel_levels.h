// Mip levels of rasters as arrays of 32-bit texels, from which SIMD code gathers. Tiles are converted lazily, on first
// use.
#pragma once

#include "pbm_format/rasters/tiled_image.h"
#include "pbm_render/picture/framebuffer.h"

#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

namespace pbm {

// A texel is a 32-bit word. A raster of colours stores the square roots of linear red, green and blue, 10 bits each,
// red lowest: this is finer than sRGB's 8 bits everywhere, and one multiplication gives linear light. Rasters of values
// store one byte each.
inline constexpr float kRootSteps = 1023;
std::uint32_t pack_roots(Rgb8 srgb);
Float4 unpack_roots(std::uint32_t texel); // linear

// One mip level, powers of two wide and high.
struct TexelLevel {
    const std::uint32_t *texels = nullptr; // [height][width]
    int width_bits = 0, height_bits = 0;
    int width() const { return 1 << width_bits; }
    int height() const { return 1 << height_bits; }
};

class TexelLevels {
  public:
    // `images`: one raster of colours, or up to four rasters of values of one size, the first in the lowest byte. Tiles
    // that are damaged or have not arrived read as the next coarser level; without any such level as `missing`, in
    // every channel.
    TexelLevels(std::vector<std::shared_ptr<const TiledImage>> images, std::uint8_t missing);

    int levels() const { return images_.front()->levels(); }
    int width_bits() const { return width_bits_; }
    // Returns a level whose texels first_x .. last_x, first_y .. last_y are ready: converts their tiles if necessary.
    // Thread-safe; cheap where they are ready.
    TexelLevel require(int level, int first_x, int first_y, int last_x, int last_y) const;
    // The one value of all these texels, if the cells that contain them are ready and hold no other value. Rasters of
    // values only.
    std::optional<std::uint32_t> only_value(int level, int first_x, int first_y, int last_x, int last_y) const;
    // Makes `require` try tiles again that read as coarser ones. Must not be called while a picture is drawn.
    void retry() const;

  private:
    struct Level {
        std::once_flag begun;
        PixelArray<std::uint32_t> texels;
        std::unique_ptr<std::atomic<bool>[]> is_ready;       // [tiles]
        std::unique_ptr<std::atomic<std::uint64_t>[]> cells; // [rows][columns]: one value, or kManyValues; or null
    };

    std::uint32_t *begin(Level &level, int number) const;
    void make_ready(Level &level, int number, std::uint32_t tx, std::uint32_t ty) const;
    const std::uint8_t *coarser_texel(const TiledImage &image, int level, std::uint32_t x, std::uint32_t y) const;
    void find_cells(Level &level, int number, std::uint32_t tx, std::uint32_t ty) const;
    void convert_row(const TiledImage &image, const std::uint8_t *from, std::size_t count, unsigned shift,
                     std::uint32_t *to) const;

    const std::vector<std::shared_ptr<const TiledImage>> images_;
    const std::array<std::uint8_t, 3> missing_;
    std::array<std::uint32_t, 256> roots_{}; // of linear light, by sRGB value
    int width_bits_ = 0, height_bits_ = 0;
    mutable std::vector<Level> levels_;
    mutable std::array<std::mutex, 16> mutexes_; // of tiles being made ready
    mutable std::mutex patched_mutex_;
    mutable std::vector<std::atomic<bool> *> patched_; // is_ready of tiles that read as coarser ones
};

} // namespace pbm
