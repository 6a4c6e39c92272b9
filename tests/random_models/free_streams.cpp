#include "random_models/free_streams.h"

#include "pbm_format/chunks/chunk.h"
#include "pbm_format/chunks/normal_cone.h"
#include "pbm_format/chunks/stream_rules.h"
#include "pbm_format/container/field_sections.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/streams/frame.h"
#include "pbm_format/streams/texel_filter.h"
#include "pbm_format/writing/chunk_encoder.h"
#include "pbm_format/writing/raster_encoder.h"
#include "pbm_format/writing/stream_filter.h"

#include <zstd.h>

#include <algorithm>
#include <memory>
#include <new>
#include <optional>

namespace pbm::test {

namespace {

// A frame that 5.6 allows, if it is smaller than `raw` and by no more than kMaxExpansion.
std::optional<Bytes> random_frame(ByteView raw, Random &random) {
    static const std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx *)> context(ZSTD_createCCtx(), ZSTD_freeCCtx);
    if (!context)
        throw std::bad_alloc();
    ZSTD_CCtx_reset(context.get(), ZSTD_reset_session_and_parameters);
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, static_cast<int>(random.below(18)) - 5);
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, random.below(2) == 0 ? 1 : 0);
    Bytes frame(ZSTD_compressBound(raw.size()));
    const std::size_t size = ZSTD_compress2(context.get(), frame.data(), frame.size(), raw.data(), raw.size());
    if (ZSTD_isError(size) != 0 || size >= raw.size() || raw.size() / kMaxExpansion > size)
        return std::nullopt;
    frame.resize(size);
    return frame;
}

// Turns random pairs (5.8.2) into escapes although they need none.
void escape_pairs(Bytes &pairs, Bytes &escapes, Random &random) {
    Bytes more;
    std::size_t next = 0; // index into the existing escapes
    for (std::uint8_t &pair : pairs) {
        if (pair == 15) {
            more.insert(more.end(), {escapes[next], escapes[next + 1]});
            next += 2;
        } else if (random.below(8) == 0) {
            more.insert(more.end(), {static_cast<std::uint8_t>(pair & 15), static_cast<std::uint8_t>(pair >> 4)});
            pair = 15;
        }
    }
    escapes = std::move(more);
}

// Random changes of the encoding that leave the decoded values unchanged.
void vary_planes(Filter filter, std::vector<Bytes> &planes, Random &random) {
    if (planes.size() > 1 && random.below(2) == 0)
        escape_pairs(planes[planes.size() - 2], planes.back(), random);
    if (filter == Filter::colour565 && random.below(2) == 0)
        for (std::uint8_t &green : planes[0]) // codes are equal modulo 64: 5.8.5
            green = static_cast<std::uint8_t>(random.below(2) == 0 && green < 128 ? green + 128 : green);
}

// Planes behind their size fields: 5.8.1.
Bytes store_planes(std::span<const Bytes> planes, Random &random) {
    ByteWriter entries;
    Bytes frames;
    for (const Bytes &plane : planes) {
        const std::optional<Bytes> frame =
            plane.empty() || random.below(3) == 0 ? std::nullopt : random_frame(plane, random);
        const Bytes &stored = frame ? *frame : plane;
        entries.u32(static_cast<std::uint32_t>(stored.size()) | (frame ? 1U << 31 : 0U));
        frames.insert(frames.end(), stored.begin(), stored.end());
    }
    entries.append(frames);
    return entries.take();
}

StreamEntry append(const Bytes &stored, Filter filter, bool zstd, Bytes &out) {
    out.insert(out.end(), stored.begin(), stored.end());
    return {.stored_bytes = static_cast<std::uint32_t>(stored.size()), .filter = filter, .zstd = zstd};
}

// Stores `planes` if 5.4.2 allows it, else a frame or the raw bytes.
StreamEntry append_any(const Bytes &raw, Filter filter, const std::optional<std::vector<Bytes>> &planes, Random &random,
                       Bytes &out) {
    if (planes && random.below(4) != 0) {
        const Bytes stored = store_planes(*planes, random);
        if (stored.size() < raw.size() && raw.size() / kMaxExpansion <= stored.size())
            return append(stored, filter, false, out);
    }
    if (random.below(3) != 0)
        if (const std::optional<Bytes> frame = random_frame(raw, random))
            return append(*frame, Filter::none, true, out);
    return append(raw, Filter::none, false, out);
}

} // namespace

StreamEntry append_freely(const StreamContext &context, ByteView masks, const PointView &points,
                          const ChunkNodes &nodes, Random &random, Bytes &out) {
    const Filter filter = filter_of(context.stream, context.set);
    auto planes = filter_stream(context, masks, points, nodes);
    if (planes)
        vary_planes(filter, *planes, random);
    return append_any(raw_stream(context, masks, points), filter, planes, random, out);
}

StreamEntry append_raw_freely(const Bytes &raw, bool as_they_are, Random &random, Bytes &out) {
    return as_they_are || raw.empty() ? append(raw, Filter::none, false, out)
                                      : append_any(raw, Filter::none, {}, random, out);
}

StreamEntry append_field_freely(const Field &field, ByteView masks, ByteView points, ByteView parents, Random &random,
                                Bytes &out) {
    const auto planes = filter_field(field, masks, points, parents);
    return append_any(Bytes(points.begin(), points.end()), filter_of(field), planes, random, out);
}

NormalCone random_cone(std::span<const std::uint16_t> normals, Random &random) {
    const NormalCone narrow = bound_normals(normals);
    if (narrow.cosine == kNoCone || random.below(4) == 0)
        return {};
    NormalCone cone = narrow;
    if (random.below(2) == 0) { // random axis
        cone.axis = static_cast<std::uint16_t>(random.below(kNormalCount));
        const IntegerNormal &axis = integer_normal_table()[cone.axis];
        std::int32_t least = 32767 * 32767;
        for (const std::uint16_t normal : normals) {
            const IntegerNormal &n = integer_normal_table()[normal];
            least = std::min(least, axis[0] * n[0] + axis[1] * n[1] + axis[2] * n[2]);
        }
        const std::int32_t cosine = std::clamp(least / 32767 - 1, -32767, 32767);
        cone.cosine = static_cast<std::int16_t>(cosine);
    } else if (random.below(2) == 0) { // wider than necessary
        cone.cosine = static_cast<std::int16_t>(
            cone.cosine - static_cast<int>(random.below(static_cast<std::uint64_t>(cone.cosine + 32767))));
    }
    return cone.cosine == kNoCone ? NormalCone{} : cone;
}

Bytes encode_image_freely(const Image &image, Random &random) {
    const TileGrid grid(image.width, image.height, image.channels);
    std::vector<Image> levels{image};
    for (int level = 1; level < grid.levels(); ++level)
        levels.push_back(halved(levels.back()));
    ByteWriter directory;
    for (const std::uint32_t field : {image.width, image.height, static_cast<std::uint32_t>(grid.tiles())})
        directory.u32(field);
    directory.u16(1);
    directory.u8(static_cast<std::uint8_t>(image.channels));
    directory.zeros(9);
    Bytes tiles;
    for (int level = grid.levels() - 1; level >= 0; --level)
        for (std::uint32_t ty = 0; ty < grid.tiles_down(level); ++ty)
            for (std::uint32_t tx = 0; tx < grid.tiles_across(level); ++tx) {
                const Bytes texels = cut_tile(grid, level, levels[static_cast<std::size_t>(level)], tx, ty);
                const std::size_t first = tiles.size();
                const StreamEntry tile =
                    append_any(texels, Filter::texels, filter_texels(texels, grid.tile_width(level), grid.channels()),
                               random, tiles);
                directory.u64(hash64(ByteView(tiles).subspan(first)));
                directory.u32(tile.stored_bytes | static_cast<std::uint32_t>(tile.filter) << 24 |
                              (tile.zstd ? 1U << 31 : 0U));
                directory.u32(0);
            }
    ByteWriter section;
    section.u64(hash64(directory.bytes()));
    section.append(directory.bytes());
    section.append(tiles);
    return section.take();
}

} // namespace pbm::test
