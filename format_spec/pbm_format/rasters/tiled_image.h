// A raster with its mip levels in tiles: what pictures are sampled from. BVG.md 3.10.
//
// From memory, or from a file where a tile is verified and decoded when it is first asked for. Immutable to look at;
// safe to use from several threads. Texel (x, y) of a level lies in tile (x / kTileEdge, y / kTileEdge) at row y %
// kTileEdge, column x % kTileEdge; a row of a tile has tile_width(level) texels.
//
// Tiles of a source that is not whole may not be there yet: they are asked for, and looked for again when they are next
// needed.
// Stability: stable.
#pragma once

#include "pbm_format/model/model.h"
#include "system/byte_source.h"
#include "system/error.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace pbm {

struct ImageDirectory; // image_section.h

// Texels per edge of a tile. Levels smaller than that have tiles as small as they are.
inline constexpr std::uint32_t kTileEdge = 64;
inline constexpr std::size_t kMaxTileBytes = std::size_t{kTileEdge} * kTileEdge * 3;

// Which tiles a raster has, all levels, and their numbers in the order of the file.
class TileGrid {
  public:
    TileGrid() = default;
    TileGrid(std::uint32_t width, std::uint32_t height, std::uint32_t channels); // is_storable

    std::uint32_t channels() const { return channels_; }
    int levels() const { return levels_; }
    std::uint32_t width(int level) const { return width_ >> level; }
    std::uint32_t height(int level) const { return height_ >> level; }
    // Texels of a tile; all tiles of a level are of one size.
    std::uint32_t tile_width(int level) const { return std::min(kTileEdge, width(level)); }
    std::uint32_t tile_height(int level) const { return std::min(kTileEdge, height(level)); }
    std::uint32_t tiles_across(int level) const { return width(level) / tile_width(level); }
    std::uint32_t tiles_down(int level) const { return height(level) / tile_height(level); }
    std::size_t tile_bytes(int level) const { return std::size_t{tile_width(level)} * tile_height(level) * channels_; }

    std::size_t tiles() const { return tiles_; }                                                     // of all levels
    std::size_t first_tile(int level) const { return first_tile_[static_cast<std::size_t>(level)]; } // of a level
    std::size_t tile_number(int level, std::uint32_t tx, std::uint32_t ty) const {
        return first_tile(level) + std::size_t{ty} * tiles_across(level) + tx;
    }
    int level_of(std::size_t tile) const;
    std::uint64_t texel_bytes() const; // of all levels

  private:
    std::uint32_t width_ = 0, height_ = 0, channels_ = 0;
    int levels_ = 0;
    std::size_t tiles_ = 0;
    std::array<std::size_t, 15> first_tile_{}; // [levels]
};

class TiledImage {
  public:
    // What was read of a file so far; for a raster in memory, no tile and no stored byte.
    struct Statistics {
        std::uint64_t tiles = 0;        // verified
        std::uint64_t stored_bytes = 0; // of them and of the directory, in the file
        std::uint64_t memory_bytes = 0; // held by this object: texels that do not lie in the file, directory
    };

    // In memory, with its mip levels. The image is_storable.
    static TiledImage of(const Image &image);
    // Verifies header and tile directory of a section that starts at `offset_in_file`. The bytes stay readable as long
    // as this lives; raw tiles are used where they lie.
    static Result<TiledImage> open(ByteView section, std::uint64_t offset_in_file);

    // A section of a file, with its directory, which was verified. Drops tiles from a source that is not whole as soon
    // as they are decoded.
    static TiledImage open(ByteSource file, FileRange section, ImageDirectory directory);

    TiledImage(TiledImage &&) noexcept;
    TiledImage &operator=(TiledImage &&) noexcept;
    ~TiledImage();

    const TileGrid &grid() const;
    std::uint32_t width(int level = 0) const { return grid().width(level); }
    std::uint32_t height(int level = 0) const { return grid().height(level); }
    std::uint32_t channels() const { return grid().channels(); }
    int levels() const { return grid().levels(); }

    // Texels [tile_height(level)][tile_width(level)][channels] of a tile, valid as long as this lives. Null if the tile
    // is damaged, which is found out once, or not there yet; the others stay usable.
    const std::uint8_t *tile(int level, std::uint32_t tx, std::uint32_t ty) const;
    // One texel, [channels]; null as its tile. For few texels: a loop asks for a tile once.
    const std::uint8_t *texel(int level, std::uint32_t x, std::uint32_t y) const;

    // A level as a whole, or the first error of its tiles. All of the section is there.
    Result<Image> level_image(int level, int threads = 1) const;

    // Errors since the last call, each tile's once. Also from several threads.
    std::vector<Error> take_errors() const;
    // Where the tiles lie in the file that were asked for since the last call and are not there yet, coarse to fine.
    // Also from several threads.
    std::vector<FileRange> take_wanted() const;
    Statistics statistics() const;

  private:
    struct State;
    explicit TiledImage(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

// The rasters of a file or of a model; null where there is none.
struct TiledImages {
    std::shared_ptr<const TiledImage> panorama, ground_texture;
    std::vector<std::shared_ptr<const TiledImage>> ground_lit; // one for each light with a shadow stream, or none

    static TiledImages of(const ModelImages &images);

    // Calls use(image) for those that there are.
    template <class Use> void for_each(Use &&use) const {
        for (const auto &image : {panorama, ground_texture})
            if (image)
                use(*image);
        for (const auto &lit : ground_lit)
            use(*lit);
    }
};

} // namespace pbm
