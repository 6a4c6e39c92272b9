#include "pbm_format/writing/raster_encoder.h"

#include "pbm_format/hashes/hash.h"
#include "pbm_format/rasters/image_section.h"
#include "pbm_format/streams/texel_filter.h"
#include "pbm_format/writing/frame_encoder.h"
#include "system/threads/parallel.h"

namespace pbm {

namespace {

std::uint8_t zigzag(unsigned difference) {
    return static_cast<std::uint8_t>(difference << 1 ^ ((difference & 0x80) != 0 ? 0xFFU : 0U));
}

using Texel = std::array<std::uint8_t, kMaxChannels>;

// The values of a texel in the planes: channel 1 (or the only one), and the others minus it.
Texel decorrelated(const std::uint8_t *texel, std::size_t channels) {
    if (channels == 1)
        return {texel[0]};
    return {texel[1], static_cast<std::uint8_t>(texel[0] - texel[1]), static_cast<std::uint8_t>(texel[2] - texel[1])};
}

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

// Stores the smaller of the filtered and the plain tile.
StreamEntry pack_tile(ByteView texels, const TileGrid &grid, int level, int compression_level, Bytes &stored) {
    Bytes filtered;
    append_planes(filter_texels(texels, grid.tile_width(level), grid.channels()), compression_level, filtered);
    const StoredFrame plain = append_frame(texels, compression_level, stored);
    if (filtered.size() >= stored.size())
        return {.stored_bytes = plain.stored_bytes, .zstd = plain.zstd};
    stored = std::move(filtered);
    return {.stored_bytes = static_cast<std::uint32_t>(stored.size()), .filter = Filter::texels};
}

} // namespace

std::vector<Bytes> filter_texels(ByteView texels, std::size_t width, std::size_t channels) {
    std::vector<Bytes> planes(channels, Bytes(texels.size() / channels));
    for (std::size_t i = 0; i < planes[0].size(); ++i) {
        const Texel here = decorrelated(&texels[i * channels], channels);
        Texel before{};
        if (i > 0) // the left neighbour; in the first column the one above
            before = decorrelated(&texels[(i % width != 0 ? i - 1 : i - width) * channels], channels);
        for (std::size_t c = 0; c < channels; ++c)
            planes[c][i] = zigzag(static_cast<unsigned>(here[c] - before[c]));
    }
    return planes;
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
                tile.stream = pack_tile(texels, grid, level, compression_level, stored[first + i]);
            } else {
                tile.stream = {.stored_bytes = static_cast<std::uint32_t>(texels.size())};
                stored[first + i] = std::move(texels);
            }
            tile.hash = hash64(stored[first + i]);
        });
    }
    Bytes section = encode_directory(directory);
    for (const Bytes &tile : stored) {
        section.resize(align_tile(section.size(), storage), 0);
        section.insert(section.end(), tile.begin(), tile.end());
    }
    section.resize(align_tile(section.size(), storage), 0);
    return section;
}

} // namespace pbm
