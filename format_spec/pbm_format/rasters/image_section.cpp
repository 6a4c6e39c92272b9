#include "pbm_format/rasters/image_section.h"

#include "pbm_format/hashes/hash.h"
#include "pbm_format/streams/frame.h"
#include "pbm_format/streams/texel_filter.h"
#include "system/threads/parallel.h"

#include <bit>
#include <optional>

namespace pbm {

namespace {

constexpr std::size_t kHeadBytes = 32;
constexpr std::size_t kTileEntryBytes = 16;
constexpr std::size_t kHashBytes = 8; // in front of what it covers

Error of_tile(std::size_t number, Error error) {
    error.tile = static_cast<std::int64_t>(number);
    return error;
}

std::string shape_text(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
    return std::to_string(width) + " x " + std::to_string(height) + ", " + std::to_string(channels) + " channels";
}

} // namespace

std::uint64_t image_directory_bytes(const TileGrid &grid) { return kHeadBytes + kTileEntryBytes * grid.tiles(); }

namespace {

struct Head {
    std::uint64_t hash = 0;
    std::uint32_t width = 0, height = 0, tiles = 0;
    std::uint16_t alignment = 0;
    std::uint8_t channels = 0;
};

// 3.10.9, 3.10.10 for the tile whose entry is at `at` of the file.
Status check_tile(const TileEntry &tile, std::size_t raw_bytes, std::size_t channels, Storage storage,
                  std::uint64_t at) {
    const StreamEntry &stream = tile.stream;
    if (stream.filter != Filter::none && stream.filter != Filter::texels)
        return broken("3.10.9", at + 8, "a filter of tiles this program does not know", "0 or 9",
                      static_cast<unsigned>(stream.filter));
    const bool sized =
        stream.filter != Filter::none
            ? !stream.zstd && stream.stored_bytes >= kPlaneEntryBytes * channels && stream.stored_bytes < raw_bytes
        : stream.zstd ? stream.stored_bytes >= 1 && stream.stored_bytes < raw_bytes
                      : stream.stored_bytes == raw_bytes;
    if (!sized)
        return broken("3.10.10", at + 8, "the stored size of a tile is impossible for its raw size",
                      (stream.zstd || stream.filter != Filter::none ? "less than " : "") + std::to_string(raw_bytes),
                      stream.stored_bytes);
    if (storage == Storage::mapped && (stream.zstd || stream.filter != Filter::none))
        return broken("3.10.10", at + 8, "a tile of a mapped file is not stored raw");
    return {};
}

// The shape, once the hash has been verified.
Result<ImageDirectory> shape_of(const Head &head, std::uint8_t reserved, std::uint64_t offset) {
    if (!is_storable(head.width, head.height, head.channels))
        return broken("3.10.4", offset + 8,
                      "width and height of a raster are not powers of two, height <= width <= 2 x "
                      "height, width <= 16,384, or it has not 1 or 3 channels",
                      "powers of two, height <= width <= 2 x height, width <= 16384, 1 or 3 channels",
                      shape_text(head.width, head.height, head.channels));
    if (head.alignment != 1 && head.alignment != kMappedStreamAlignment)
        return broken("3.10.5", offset + 20, "the alignment of tiles is not 1 or 64", "1 or 64", head.alignment);
    if (reserved != 0)
        return broken("3.10.6", offset + 23, "reserved bytes are not zero", 0, reserved);
    ImageDirectory directory{.grid = TileGrid(head.width, head.height, head.channels),
                             .storage = head.alignment == 1 ? Storage::packed : Storage::mapped,
                             .tiles = {}};
    if (directory.grid.tiles() != head.tiles)
        return broken("3.10.7", offset + 16, "not as many tiles as the raster has", directory.grid.tiles(), head.tiles);
    return directory;
}

} // namespace

FileRange image_directory_range(const SectionEntry &entry) {
    const std::uint64_t tiles = std::min(entry.count, entry.stored_bytes / kTileEntryBytes);
    return {entry.offset, std::min(entry.stored_bytes, kHeadBytes + kTileEntryBytes * tiles)};
}

Result<ImageDirectory> decode_image_directory(ByteView start, std::uint64_t section_bytes, std::uint64_t offset) {
    if (start.size() < kHeadBytes)
        return broken("3.10.1", offset, "the header of a raster is cut short", kHeadBytes, start.size());
    ByteReader in(start);
    Head head;
    head.hash = in.u64();
    head.width = in.u32();
    head.height = in.u32();
    head.tiles = in.u32();
    head.alignment = in.u16();
    head.channels = in.u8();
    in.zeros(9);
    if (head.tiles > (start.size() - kHeadBytes) / kTileEntryBytes)
        return broken("3.10.2", offset + 16, "the tile directory is cut short",
                      "at most " + std::to_string((start.size() - kHeadBytes) / kTileEntryBytes) + " tiles",
                      head.tiles);
    std::uint64_t end = kHeadBytes + kTileEntryBytes * head.tiles;
    if (const std::uint64_t hash = hash64(slice(start, kHashBytes, end - kHashBytes)); hash != head.hash)
        return broken("3.10.3", offset, "the tile directory was changed: its hash does not match",
                      hash_value(head.hash), hash_value(hash));
    Result<ImageDirectory> directory = shape_of(head, in.reserved(), offset);
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
        if (const std::uint32_t reserved = in.u32(); reserved != 0)
            return of_tile(number, broken("3.10.8", at + 12, "reserved bytes are not zero", 0, reserved));
        const int level = directory->grid.level_of(number);
        if (Status status = check_tile(tile, directory->grid.tile_bytes(level), head.channels, directory->storage, at);
            !status)
            return of_tile(number, std::move(status).error());
        tile.offset = align_tile(end, directory->storage);
        if (tile.offset > section_bytes || tile.stream.stored_bytes > section_bytes - tile.offset)
            return of_tile(
                number, broken("3.10.11", at + 8, "a tile lies outside its section",
                               "ends within " + std::to_string(section_bytes) + " bytes",
                               std::to_string(tile.stream.stored_bytes) + " bytes at " + std::to_string(tile.offset)));
        end = tile.offset + tile.stream.stored_bytes;
        directory->tiles.push_back(tile);
    }
    if (align_tile(end, directory->storage) != section_bytes)
        return broken("3.10.11", offset + end, "bytes after the last tile", align_tile(end, directory->storage),
                      section_bytes);
    return directory;
}

Result<ImageDirectory> read_image_directory(const ByteSource &file, const SectionEntry &entry, Storage storage) {
    // Of a whole file all of the section, so that a wrong number of tiles in the table is found as such.
    const FileRange range = file.is_whole() ? entry.range() : image_directory_range(entry);
    const Result<HeldBytes> start = file.require(range);
    if (!start)
        return start.error();
    Result<ImageDirectory> directory = decode_image_directory(start->bytes, entry.stored_bytes, entry.offset);
    if (!directory)
        return directory;
    if (directory->storage != storage)
        return broken("3.10.5", entry.offset + 20,
                      "tiles are not aligned as those of a " + std::string(to_string(storage)) + " file",
                      storage == Storage::mapped ? 64 : 1, storage == Storage::mapped ? 1 : 64);
    const TileGrid &grid = directory->grid;
    const bool panorama = entry.type == SectionType::panorama;
    const bool shaped =
        panorama ? grid.channels() == 3 && grid.width(0) == 2 * grid.height(0)
                 : grid.channels() == 1 && grid.width(0) == grid.height(0) && grid.width(0) <= kMaxGroundRaster;
    if (!shaped)
        return broken("3.10.15", entry.offset + 8,
                      panorama ? "a panorama is not 2:1 with three channels"
                               : "a raster of the ground plane is not square, has more than one channel or is over "
                                 "4,096 texels wide",
                      panorama ? "2:1, 3 channels" : "square, at most 4096, 1 channel",
                      shape_text(grid.width(0), grid.height(0), grid.channels()));
    const std::uint64_t raw_bytes =
        storage == Storage::mapped ? entry.stored_bytes : image_directory_bytes(grid) + grid.texel_bytes();
    if (entry.count != grid.tiles() || entry.raw_bytes != raw_bytes)
        return broken("3.10.16", entry.offset, "the section table counts other tiles or bytes than there are",
                      std::to_string(grid.tiles()) + " tiles, " + std::to_string(raw_bytes) + " bytes",
                      std::to_string(entry.count) + " tiles, " + std::to_string(entry.raw_bytes) + " bytes");
    return directory;
}

Status verify_tile_hash(ByteView stored, std::uint64_t offset, const ImageDirectory &directory, std::size_t number,
                        Wording wording) {
    const TileEntry &tile = directory.tiles[number];
    const std::uint64_t hash = hash64(stored);
    if (hash == tile.hash)
        return {};
    const std::string text =
        wording == Wording::full ? "tile " + std::to_string(number) + " was changed: its hash does not match" : "";
    Status status = broken(wording, "3.10.12", offset + tile.offset, text, hash_value(tile.hash), hash_value(hash));
    status.error().tile = static_cast<std::int64_t>(number);
    return status;
}

namespace {

Status decode_filtered(ByteView stored, const TileGrid &grid, std::size_t number, std::span<std::uint8_t> texels,
                       std::uint64_t offset, Wording wording) {
    thread_local std::array<std::array<std::uint8_t, kMaxTileBytes / kMaxChannels>, kMaxChannels> memory;
    const std::size_t plane_bytes = texels.size() / grid.channels();
    PlaneCursor cursor(stored, grid.channels());
    TexelPlanes planes;
    for (std::size_t c = 0; c < grid.channels(); ++c) {
        ByteView plane;
        bool zstd = false;
        if (!cursor.next(plane_bytes, plane, zstd))
            return impossible_planes(offset, wording);
        planes[c] = std::span(memory[c]).first(plane_bytes);
        if (Status status = decode_frame(plane, zstd, std::span(memory[c]).first(plane_bytes), offset, wording);
            !status)
            return status;
    }
    if (!cursor.finished())
        return impossible_planes(offset, wording);
    unfilter_texels(planes, grid.tile_width(grid.level_of(number)), grid.channels(), texels);
    return {};
}

} // namespace

Status decode_tile(ByteView stored, std::uint64_t offset, const ImageDirectory &directory, std::size_t number,
                   std::span<std::uint8_t> texels, Wording wording) {
    assert(texels.size() == directory.grid.tile_bytes(directory.grid.level_of(number)));
    if (Status status = verify_tile_hash(stored, offset, directory, number, wording); !status)
        return status;
    const TileEntry &tile = directory.tiles[number];
    Status status = tile.stream.filter == Filter::none
                        ? decode_frame(stored, tile.stream.zstd, texels, offset + tile.offset, wording)
                        : decode_filtered(stored, directory.grid, number, texels, offset + tile.offset, wording);
    if (!status)
        status.error().tile = static_cast<std::int64_t>(number);
    return status;
}

void place_tile(const TileGrid &grid, int level, std::size_t index, const std::uint8_t *texels, Image &image) {
    const std::size_t across = grid.tiles_across(level);
    const std::size_t tile_row = std::size_t{grid.tile_width(level)} * image.channels;
    std::uint8_t *to =
        image.texels.data() + (index / across * grid.tile_height(level) * across + index % across) * tile_row;
    for (std::uint32_t y = 0; y < grid.tile_height(level); ++y, texels += tile_row, to += across * tile_row)
        std::copy_n(texels, tile_row, to);
}

namespace {

Image empty_level(const TileGrid &grid, int level) {
    Image image{.width = grid.width(level), .height = grid.height(level), .channels = grid.channels(), .texels = {}};
    image.texels.resize(std::size_t{image.width} * image.height * image.channels);
    return image;
}

// Decodes a tile to texels in memory that the thread reuses for its next tile.
Status decode_tile(const StoredRaster &raster, std::size_t number, Wording wording, ByteView &texels) {
    thread_local std::array<std::uint8_t, kMaxTileBytes> memory;
    const TileGrid &grid = raster.directory.grid;
    const auto tile = std::span(memory).first(grid.tile_bytes(grid.level_of(number)));
    texels = tile;
    const TileEntry &entry = raster.directory.tiles[number];
    return decode_tile(slice(raster.section, entry.offset, entry.stream.stored_bytes), raster.offset, raster.directory,
                       number, tile, wording);
}

} // namespace

std::vector<const CatalogueEntry *> decode_tiles(const StoredRaster &raster, int level, int threads, Image *to) {
    const TileGrid &grid = raster.directory.grid;
    if (to != nullptr)
        *to = empty_level(grid, level);
    std::vector<const CatalogueEntry *> refused(std::size_t{grid.tiles_across(level)} * grid.tiles_down(level));
    parallel_for(refused.size(), threads, [&](std::size_t i) {
        ByteView texels;
        const Status status = decode_tile(raster, grid.first_tile(level) + i, Wording::none, texels);
        if (!status)
            refused[i] = entry_of(status.error());
        else if (to != nullptr)
            place_tile(grid, level, i, texels.data(), *to);
    });
    return refused;
}

Error explain_tile(const StoredRaster &raster, std::size_t number, const CatalogueEntry &entry) {
    ByteView texels;
    Status status = decode_tile(raster, number, Wording::full, texels);
    if (!status)
        return std::move(status).error();
    return of_tile(number, {.code = entry.kind, // another process changed the bytes in the meantime
                            .offset = raster.offset + raster.directory.tiles[number].offset,
                            .message = std::string(entry.meaning),
                            .name = entry.name});
}

Result<Image> decode_level(ByteView section, std::uint64_t offset, const ImageDirectory &directory, int level,
                           int threads) {
    const StoredRaster raster{section, offset, directory};
    Image image;
    const std::vector<const CatalogueEntry *> refused = decode_tiles(raster, level, threads, &image);
    for (std::size_t i = 0; i < refused.size(); ++i)
        if (refused[i] != nullptr)
            return explain_tile(raster, directory.grid.first_tile(level) + i, *refused[i]);
    return image;
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

} // namespace pbm
