#include "pbm_format/checking/raster_rules.h"

#include <algorithm>

namespace pbm {

namespace {

// 3.10.13
void check_padding(const StoredRaster &raster, FaultSink &faults) {
    std::uint64_t end = image_directory_bytes(raster.directory.grid);
    const auto check_until = [&](std::uint64_t next) {
        for (; end < next; ++end)
            if (const std::uint8_t byte = slice(raster.section, end, 1)[0]; byte != 0)
                return faults.add(broken("3.10.13", raster.offset + end, "padding of a raster is not zero", 0, byte));
    };
    for (const TileEntry &tile : raster.directory.tiles) {
        check_until(tile.offset);
        end = tile.offset + tile.stream.stored_bytes;
    }
    check_until(raster.section.size());
}

// 3.10.14
void check_means(const Image &expected, const Image &image, std::uint64_t offset, int level, FaultSink &faults) {
    if (expected == image)
        return;
    const auto differ = std::mismatch(expected.texels.begin(), expected.texels.end(), image.texels.begin());
    const auto texel = static_cast<std::size_t>(differ.first - expected.texels.begin()) / image.channels;
    faults.add(broken("3.10.14", offset,
                      "mip level " + std::to_string(level) + " does not hold the means of the finer one: texel " +
                          std::to_string(texel % image.width) + ", " + std::to_string(texel / image.width),
                      *differ.first, *differ.second));
}

// Decodes a level. After a fault it still checks tiles, but keeps no texels.
Image check_tiles(const StoredRaster &raster, int level, int threads, FaultSink &faults) {
    Image image;
    const auto refused = decode_tiles(raster, level, threads, faults.count == 0 ? &image : nullptr);
    for (std::size_t i = 0; i < refused.size(); ++i)
        if (refused[i] != nullptr && faults.counts(*refused[i]))
            faults.take(explain_tile(raster, raster.directory.grid.first_tile(level) + i, *refused[i]));
    return image;
}

} // namespace

void FaultSink::add(Error error) {
    if (counts(*entry_of(error)))
        take(std::move(error));
}

Image check_raster(const StoredRaster &raster, int threads, bool means, FaultSink &faults) {
    const TileGrid &grid = raster.directory.grid;
    check_padding(raster, faults);
    // From coarse to fine, as stored: allocate a level only after the one above, a quarter of its size, was decoded.
    std::vector<Image> levels(static_cast<std::size_t>(grid.levels()));
    for (int level = grid.levels() - 1; level >= 0; --level)
        levels[static_cast<std::size_t>(level)] = check_tiles(raster, level, threads, faults);
    for (int level = 1; level < grid.levels() && means && faults.count == 0; ++level)
        check_means(halved(levels[static_cast<std::size_t>(level) - 1]), levels[static_cast<std::size_t>(level)],
                    raster.offset, level, faults);
    return std::move(levels[0]);
}

} // namespace pbm
