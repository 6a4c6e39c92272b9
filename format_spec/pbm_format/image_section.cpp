#include "pbm_format/image_section.h"

#include "pbm_format/frame.h"
#include "pbm_format/hash.h"
#include "pbm_format/parallel.h"

#include <bit>

namespace pbm {

namespace {

constexpr std::size_t kHeadBytes = 32;
constexpr std::size_t kTileEntryBytes = 16;
constexpr std::size_t kHashBytes = 8; // in front of what it covers

std::uint64_t align(std::uint64_t offset, Storage storage) {
    return storage == Storage::mapped ? align_stream(offset) : offset;
}

Error bad_image(std::uint64_t offset, std::string message) {
    return {ErrorCode::bad_image, offset, std::move(message)};
}

} // namespace

TileGrid::TileGrid(std::uint32_t width, std::uint32_t height, std::uint32_t channels)
    : width_(width), height_(height), channels_(channels), levels_(mip_levels(height)) {
    assert(is_storable(width, height, channels));
    for (int level = levels_ - 1; level >= 0; --level) {
        first_tile_[static_cast<std::size_t>(level)] = tiles_;
        tiles_ += std::size_t{tiles_across(level)} * tiles_down(level);
    }
}

int TileGrid::level_of(std::size_t tile) const {
    int level = 0;
    while (first_tile(level) > tile)
        ++level;
    return level;
}

std::uint64_t TileGrid::texel_bytes() const {
    std::uint64_t bytes = 0;
    for (int level = 0; level < levels_; ++level)
        bytes += std::uint64_t{width(level)} * height(level) * channels_;
    return bytes;
}

std::uint64_t image_directory_bytes(const TileGrid &grid) { return kHeadBytes + kTileEntryBytes * grid.tiles(); }

namespace {

struct Head {
    std::uint64_t hash = 0;
    std::uint32_t width = 0, height = 0, tiles = 0;
    std::uint16_t alignment = 0;
    std::uint8_t channels = 0;
};

Bytes encode_directory(const ImageDirectory &directory) {
    const TileGrid &grid = directory.grid;
    ByteWriter out;
    out.u32(grid.width(0));
    out.u32(grid.height(0));
    out.u32(static_cast<std::uint32_t>(grid.tiles()));
    out.u16(directory.storage == Storage::mapped ? kMappedStreamAlignment : 1);
    out.u8(static_cast<std::uint8_t>(grid.channels()));
    out.u8(0);
    out.u64(0);
    for (const TileEntry &tile : directory.tiles) {
        out.u64(tile.hash);
        out.u32(tile.stream.stored_bytes | std::uint32_t{static_cast<std::uint8_t>(tile.stream.filter)} << 24 |
                (tile.stream.zstd ? 1U << 31 : 0U));
        out.zeros(4);
    }
    ByteWriter whole;
    whole.u64(hash64(out.bytes()));
    whole.append(out.bytes());
    return whole.take();
}

// 3.10.10 for the tile whose entry is at `at` of the file.
Status check_tile(const TileEntry &tile, std::size_t raw_bytes, Storage storage, std::uint64_t at) {
    const StreamEntry &stream = tile.stream;
    if (stream.filter != Filter::none)
        return Error{ErrorCode::unsupported_feature, at + 8, "3.10.9 a filter of tiles this program does not know"};
    const bool sized =
        stream.zstd ? stream.stored_bytes >= 1 && stream.stored_bytes < raw_bytes : stream.stored_bytes == raw_bytes;
    if (!sized)
        return bad_image(at + 8, "3.10.10 stored size of a tile that cannot be");
    if (storage == Storage::mapped && stream.zstd)
        return bad_image(at + 8, "3.10.10 a tile of a mapped file is not stored raw");
    return {};
}

// The shape, once the hash has been proven.
Result<ImageDirectory> shape_of(const Head &head, bool reserved_clear, std::uint64_t offset) {
    if (!is_storable(head.width, head.height, head.channels))
        return bad_image(offset + 8,
                         "3.10.4 width and height of a raster are not powers of two, height <= width <= 2 x "
                         "height, width <= 16,384, or it has not 1 or 3 channels");
    if (head.alignment != 1 && head.alignment != kMappedStreamAlignment)
        return bad_image(offset + 20, "3.10.5 the alignment of tiles is not 1 or 64");
    if (!reserved_clear)
        return bad_image(offset + 23, "3.10.6 reserved bytes are not zero");
    ImageDirectory directory{.grid = TileGrid(head.width, head.height, head.channels),
                             .storage = head.alignment == 1 ? Storage::packed : Storage::mapped,
                             .tiles = {}};
    if (directory.grid.tiles() != head.tiles)
        return bad_image(offset + 16, "3.10.7 not as many tiles as the raster has");
    return directory;
}

} // namespace

Result<ImageDirectory> decode_image_directory(ByteView section, std::uint64_t offset) {
    if (section.size() < kHeadBytes)
        return bad_image(offset, "3.10.1 the header of a raster is cut short");
    ByteReader in(section);
    Head head;
    head.hash = in.u64();
    head.width = in.u32();
    head.height = in.u32();
    head.tiles = in.u32();
    head.alignment = in.u16();
    head.channels = in.u8();
    in.zeros(9);
    if (head.tiles > (section.size() - kHeadBytes) / kTileEntryBytes)
        return bad_image(offset + 16, "3.10.2 the tile directory is cut short");
    std::uint64_t end = kHeadBytes + kTileEntryBytes * head.tiles;
    if (hash64(section.subspan(kHashBytes, end - kHashBytes)) != head.hash)
        return Error{ErrorCode::bad_hash, offset, "3.10.3 the tile directory was changed: its hash does not match"};
    Result<ImageDirectory> directory = shape_of(head, in.reserved_clear(), offset);
    if (!directory)
        return directory;
    directory->tiles.reserve(head.tiles);
    for (std::size_t number = 0; number < head.tiles; ++number) {
        const std::uint64_t at = offset + in.offset();
        TileEntry tile;
        tile.hash = in.u64();
        const std::uint32_t stream = in.u32();
        tile.stream = {.stored_bytes = stream & 0xFFFFFF,
                       .filter = Filter{static_cast<std::uint8_t>(stream >> 24 & 0x7F)},
                       .zstd = stream >> 31 != 0};
        if (in.u32() != 0)
            return bad_image(at + 12, "3.10.8 reserved bytes are not zero");
        const int level = directory->grid.level_of(number);
        if (const Status status = check_tile(tile, directory->grid.tile_bytes(level), directory->storage, at); !status)
            return status.error();
        tile.offset = align(end, directory->storage);
        if (tile.offset > section.size() || tile.stream.stored_bytes > section.size() - tile.offset)
            return bad_image(at + 8, "3.10.11 a tile lies outside its section");
        end = tile.offset + tile.stream.stored_bytes;
        directory->tiles.push_back(tile);
    }
    if (align(end, directory->storage) != section.size())
        return bad_image(offset + end, "3.10.11 bytes after the last tile");
    return directory;
}

Status prove_tile_hash(ByteView section, std::uint64_t offset, const ImageDirectory &directory, std::size_t number) {
    const TileEntry &tile = directory.tiles[number];
    if (hash64(section.subspan(tile.offset, tile.stream.stored_bytes)) == tile.hash)
        return {};
    return Error{ErrorCode::bad_hash, offset + tile.offset,
                 "3.10.12 tile " + std::to_string(number) + " was changed: its hash does not match"};
}

Status decode_tile(ByteView section, std::uint64_t offset, const ImageDirectory &directory, std::size_t number,
                   std::span<std::uint8_t> texels) {
    assert(texels.size() == directory.grid.tile_bytes(directory.grid.level_of(number)));
    if (Status status = prove_tile_hash(section, offset, directory, number); !status)
        return status;
    const TileEntry &tile = directory.tiles[number];
    return decode_frame(section.subspan(tile.offset, tile.stream.stored_bytes), tile.stream.zstd, texels,
                        offset + tile.offset);
}

Bytes cut_tile(const TileGrid &grid, int level, const Image &level_image, std::uint32_t tx, std::uint32_t ty) {
    const std::size_t row = std::size_t{level_image.width} * level_image.channels;
    const std::size_t tile_row = std::size_t{grid.tile_width(level)} * level_image.channels;
    const std::uint8_t *from =
        level_image.texels.data() + std::size_t{ty} * grid.tile_height(level) * row + tx * tile_row;
    Bytes texels;
    texels.reserve(grid.tile_bytes(level));
    for (std::uint32_t y = 0; y < grid.tile_height(level); ++y, from += row)
        texels.insert(texels.end(), from, from + tile_row);
    return texels;
}

Bytes encode_image(const Image &image, Storage storage, int compression_level, int threads) {
    ImageDirectory directory{
        .grid = TileGrid(image.width, image.height, image.channels), .storage = storage, .tiles = {}};
    const TileGrid &grid = directory.grid;
    directory.tiles.resize(grid.tiles());
    std::vector<Bytes> stored(grid.tiles());
    Image coarser;
    for (int level = 0; level < grid.levels(); ++level) {
        if (level > 0)
            coarser = halved(level == 1 ? image : coarser);
        const Image &here = level == 0 ? image : coarser;
        const std::size_t first = grid.first_tile(level);
        parallel_for(std::size_t{grid.tiles_across(level)} * grid.tiles_down(level), threads, [&](std::size_t i) {
            Bytes texels = cut_tile(grid, level, here, static_cast<std::uint32_t>(i % grid.tiles_across(level)),
                                    static_cast<std::uint32_t>(i / grid.tiles_across(level)));
            TileEntry &tile = directory.tiles[first + i];
            if (storage == Storage::packed) {
                const StoredFrame frame = append_frame(texels, compression_level, stored[first + i]);
                tile.stream = {.stored_bytes = frame.stored_bytes, .zstd = frame.zstd};
            } else {
                tile.stream = {.stored_bytes = static_cast<std::uint32_t>(texels.size())};
                stored[first + i] = std::move(texels);
            }
            tile.hash = hash64(stored[first + i]);
        });
    }
    Bytes section = encode_directory(directory);
    for (const Bytes &tile : stored) {
        section.resize(align(section.size(), storage), 0);
        section.insert(section.end(), tile.begin(), tile.end());
    }
    section.resize(align(section.size(), storage), 0);
    return section;
}

} // namespace pbm
