// The bytes of a raster in a file: header, tile directory, tiles, every mip level, coarse to fine. BVG.md 3.10.
//
//   0     32 bytes: XXH3-64 of all that follows up to the first tile; width, height, tiles, alignment, channels
//   32    16 bytes for each tile: XXH3-64 of its stored bytes; stored bytes, filter, zstd
//         tiles of the coarsest level, ..., tiles of level 0; rows of tiles, top row first
//
// A tile is verified alone, so that a picture reads only what it sees.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/law/catalogue.h"
#include "pbm_format/rasters/tiled_image.h"
#include "system/byte_source.h"
#include "system/error.h"

#include <cstdint>
#include <vector>

namespace pbm {

// Where a tile lies and how it is stored.
struct TileEntry {
    std::uint64_t hash = 0; // XXH3-64 of the stored bytes
    StreamEntry stream;
    std::uint64_t offset = 0; // in the section; a running sum
};

struct ImageDirectory {
    TileGrid grid;
    Storage storage = Storage::packed; // mapped: raw tiles at multiples of kMappedStreamAlignment
    std::vector<TileEntry> tiles;      // in the order of the file
};

// Where the next tile starts after one that ends at `end`, or the section ends; both count from its start.
constexpr std::uint64_t align_tile(std::uint64_t end, Storage storage) {
    return storage == Storage::mapped ? align_stream(end) : end;
}

std::uint64_t image_directory_bytes(const TileGrid &grid); // header included

// Proves rules 3.10.1 to 3.10.11: header and directory, which are all that is read of the section's `start`. Offsets of
// errors are those in the file, where the section starts at `offset`.
Result<ImageDirectory> decode_image_directory(ByteView start, std::uint64_t section_bytes, std::uint64_t offset);
inline Result<ImageDirectory> decode_image_directory(ByteView section, std::uint64_t offset) {
    return decode_image_directory(section, section.size(), offset);
}

// Header and tile directory of a raster in the file: as many bytes as the section table says that there are.
FileRange image_directory_range(const SectionEntry &entry);

// The same for the raster of a file's section, and rules 3.10.5, 3.10.15 and 3.10.16: it is of a shape that its type
// may have, stored as the file is, and what the table says of it. `image_directory_range` is there.
Result<ImageDirectory> read_image_directory(const ByteSource &file, const SectionEntry &entry, Storage storage);
inline Result<ImageDirectory> read_image_directory(ByteView file, const SectionEntry &entry, Storage storage) {
    return read_image_directory(ByteSource(file), entry, storage);
}

// Proves tile `number`, whose bytes are `stored`, of a section whose directory was decoded and that starts at `offset`
// of the file. Decodes it to `texels` of tile_bytes: 3.10.12, 5.6 and 5.8.
Status decode_tile(ByteView stored, std::uint64_t offset, const ImageDirectory &directory, std::size_t number,
                   std::span<std::uint8_t> texels, Wording wording = Wording::full);
// The first half of it: that the stored bytes are those that were written.
Status verify_tile_hash(ByteView stored, std::uint64_t offset, const ImageDirectory &directory, std::size_t number,
                        Wording wording = Wording::full);

// A raster in a file.
struct StoredRaster {
    ByteView section;
    std::uint64_t offset; // of the section, in the file
    const ImageDirectory &directory;
};

// Decodes the tiles of a level. `to`, if not null, becomes the level as a whole. Returns for each tile the code of its
// error, or null: to word an error takes longer than to refuse a tile, so that is left to explain_tile.
std::vector<const CatalogueEntry *> decode_tiles(const StoredRaster &raster, int level, int threads, Image *to);
// The error of a tile that was refused with the code `entry`, in full.
Error explain_tile(const StoredRaster &raster, std::size_t number, const CatalogueEntry &entry);

// All tiles of a level, or the first error.
Result<Image> decode_level(ByteView section, std::uint64_t offset, const ImageDirectory &directory, int level,
                           int threads);
// Places a tile of `level` in `image`, which is that level as a whole.
void place_tile(const TileGrid &grid, int level, std::size_t index, const std::uint8_t *texels, Image &image);

// Texels of one tile of `level_image`, which is that level as a whole.
Bytes cut_tile(const TileGrid &grid, int level, const Image &level_image, std::uint32_t tx, std::uint32_t ty);

} // namespace pbm
