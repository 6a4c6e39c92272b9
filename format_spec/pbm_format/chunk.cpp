#include "pbm_format/chunk.h"

#include <algorithm>
#include <memory>

#include <zstd.h>

namespace pbm {

namespace {

struct FreeContext {
    void operator()(ZSTD_CCtx *context) const { ZSTD_freeCCtx(context); }
    void operator()(ZSTD_DCtx *context) const { ZSTD_freeDCtx(context); }
};

// One context per thread: frames do not depend on what a context compressed before.
ZSTD_CCtx *compression_context() {
    thread_local const std::unique_ptr<ZSTD_CCtx, FreeContext> context(ZSTD_createCCtx());
    if (!context)
        throw std::bad_alloc();
    return context.get();
}

ZSTD_DCtx *decompression_context() {
    thread_local const std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
    if (!context)
        throw std::bad_alloc();
    return context.get();
}

// Shadow values of `bits` bits each, lowest bits first. BVG.md 6.6
Bytes pack_bits(ByteView values, unsigned bits) {
    Bytes packed((values.size() * bits + 7) / 8, 0);
    for (std::size_t i = 0; i < values.size(); ++i)
        packed[i * bits / 8] = static_cast<std::uint8_t>(packed[i * bits / 8] | values[i] << i * bits % 8);
    return packed;
}

void unpack_bits(ByteView packed, unsigned bits, std::span<std::uint8_t> values) {
    const unsigned mask = (1U << bits) - 1;
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<std::uint8_t>(packed[i * bits / 8] >> i * bits % 8 & mask);
}

Bytes slice(ByteView bytes, std::size_t first, std::size_t count) {
    const ByteView part = bytes.subspan(first, count);
    return {part.begin(), part.end()};
}

// The unfiltered bytes of one stream of the points [first_point, first_point + shape.points).
Bytes raw_stream(const Level &level, int level_index, const StreamInfo &stream, const ChunkShape &shape,
                 std::uint64_t first_node, std::uint64_t first_point, const AttributeSet &set) {
    const PointAttributes &points = level.points;
    switch (stream.kind) {
    case StreamKind::masks: return slice(level.masks, first_node, shape.nodes);
    case StreamKind::normal: {
        Bytes raw(std::size_t{2} * shape.points);
        std::memcpy(raw.data(), points.normals.data() + first_point, raw.size());
        return raw;
    }
    case StreamKind::radius: return slice(points.radii, first_point, shape.points);
    case StreamKind::colour: {
        const auto bytes = static_cast<std::size_t>(set.colour_bytes());
        return slice(points.colours, bytes * first_point, bytes * shape.points);
    }
    case StreamKind::material: return slice(points.materials, first_point, shape.points);
    case StreamKind::texture: return slice(points.textures, first_point, shape.points);
    case StreamKind::shadow:
        return pack_bits(ByteView(points.shadows[stream.light]).subspan(first_point, shape.points),
                         set.shadow_bits[stream.light][static_cast<std::size_t>(level_index)]);
    }
    return {};
}

} // namespace

NormalCone bound_normals(std::span<const std::uint16_t> normals) {
    std::array<std::int64_t, 3> sum{};
    for (const std::uint16_t stored : normals) {
        if ((stored & kTwoSidedBit) != 0)
            return {};
        const IntegerNormal &n = integer_normal_table()[stored & kNormalIndexMask];
        for (std::size_t c = 0; c < 3; ++c)
            sum[c] += n[c];
    }
    NormalCone cone;
    cone.axis = quantise_normal(static_cast<double>(sum[0]), static_cast<double>(sum[1]), static_cast<double>(sum[2]));
    const IntegerNormal &axis = integer_normal_table()[cone.axis];
    std::int64_t least = std::int64_t{32767} * 32767;
    for (const std::uint16_t stored : normals) {
        const IntegerNormal &n = integer_normal_table()[stored & kNormalIndexMask];
        least =
            std::min(least, std::int64_t{axis[0]} * n[0] + std::int64_t{axis[1]} * n[1] + std::int64_t{axis[2]} * n[2]);
    }
    std::int64_t cosine = least / 32767;
    if (cosine * 32767 > least)
        --cosine;
    if (cosine <= kNoCone)
        return {};
    cone.cosine = static_cast<std::int16_t>(std::min<std::int64_t>(cosine, 32767));
    return cone;
}

void encode_chunk(const Level &level, int level_index, const ChunkShape &shape, std::uint64_t first_node,
                  std::uint64_t first_point, const AttributeSet &set, int compression_level, ChunkEntry &entry,
                  Bytes &out) {
    assert(compression_level >= 1 && compression_level <= 19);
    entry.shape = shape;
    entry.first_node = first_node;
    entry.first_point = first_point;
    entry.cone = bound_normals(std::span(level.points.normals).subspan(first_point, shape.points));
    entry.streams.clear();
    const std::size_t start = out.size();
    Bytes frame;
    for (const StreamInfo &stream : streams_of(set)) {
        const Bytes raw = raw_stream(level, level_index, stream, shape, first_node, first_point, set);
        frame.resize(ZSTD_compressBound(raw.size()));
        const std::size_t size = ZSTD_compressCCtx(compression_context(), frame.data(), frame.size(), raw.data(),
                                                   raw.size(), compression_level);
        if (ZSTD_isError(size) != 0)
            throw std::bad_alloc(); // the only way to fail with a buffer of compressBound bytes
        // A frame may not be larger than its raw bytes, nor expand beyond the limit readers accept.
        const bool smaller = size < raw.size() && raw.size() / kMaxExpansion <= size;
        const ByteView stored = smaller ? ByteView(frame.data(), size) : ByteView(raw);
        entry.streams.push_back(
            {.stored_bytes = static_cast<std::uint32_t>(stored.size()), .filter = 0, .zstd = smaller});
        out.insert(out.end(), stored.begin(), stored.end());
    }
    entry.stored_bytes = out.size() - start;
    entry.hash = hash64(ByteView(out).subspan(start));
}

namespace {

// Magic number of RFC 8878 (libraries may also read older ones), single segment (so that no window is larger than the
// content), reserved bit clear, no dictionary.
bool is_plain_frame(ByteView stored) {
    constexpr std::array<std::uint8_t, 4> kFrameMagic{0x28, 0xB5, 0x2F, 0xFD};
    constexpr unsigned kSingleSegment = 0x20, kReserved = 0x08, kDictionary = 0x03;
    return stored.size() > kFrameMagic.size() && std::equal(kFrameMagic.begin(), kFrameMagic.end(), stored.begin()) &&
           (stored[4] & (kSingleSegment | kReserved | kDictionary)) == kSingleSegment;
}

// Undoes zstd. `raw` has the size that the directory promises.
Status decode_stream(ByteView stored, const StreamEntry &entry, std::span<std::uint8_t> raw, std::uint64_t offset) {
    if (!entry.zstd) {
        assert(stored.size() == raw.size());
        std::memcpy(raw.data(), stored.data(), raw.size());
        return {};
    }
    const std::size_t frame_bytes = ZSTD_findFrameCompressedSize(stored.data(), stored.size());
    if (!is_plain_frame(stored) || ZSTD_isError(frame_bytes) != 0 || frame_bytes != stored.size())
        return Error{ErrorCode::bad_attribute, offset,
                     "5.6.1 the stream is not one whole zstd frame of a single segment"};
    if (ZSTD_getFrameContentSize(stored.data(), stored.size()) != raw.size())
        return Error{ErrorCode::bad_attribute, offset, "5.6.2 the zstd frame does not announce the raw size"};
    const std::size_t size =
        ZSTD_decompressDCtx(decompression_context(), raw.data(), raw.size(), stored.data(), stored.size());
    if (ZSTD_isError(size) != 0 || size != raw.size())
        return Error{ErrorCode::bad_attribute, offset, "5.6.3 the zstd frame does not decode"};
    return {};
}

Status check_values(ByteView values, unsigned limit, std::uint64_t offset, const char *message) {
    const auto bad = std::find_if(values.begin(), values.end(), [&](std::uint8_t value) { return value >= limit; });
    if (bad != values.end())
        return Error{ErrorCode::bad_attribute, offset, message};
    return {};
}

Status check_masks(ByteView masks, const ChunkEntry &entry) {
    if (std::find(masks.begin(), masks.end(), std::uint8_t{0}) != masks.end())
        return Error{ErrorCode::bad_octree, entry.offset, "4.2 zero child mask"};
    if (count_children(masks) != entry.shape.points)
        return Error{ErrorCode::bad_octree, entry.offset,
                     "4.4 the masks announce another number of points than the directory"};
    return {};
}

Status check_normals(std::span<const std::uint16_t> normals, const NormalCone &cone, std::uint64_t offset) {
    const IntegerNormal &axis = integer_normal_table()[cone.axis];
    const std::int32_t least = cone.cosine * 32767;
    for (const std::uint16_t stored : normals) {
        if ((stored & ~(kNormalIndexMask | kTwoSidedBit)) != 0)
            return Error{ErrorCode::bad_attribute, offset, "6.1.4 a normal has reserved bits"};
        if (cone.cosine == kNoCone)
            continue;
        const IntegerNormal &n = integer_normal_table()[stored & kNormalIndexMask];
        if ((stored & kTwoSidedBit) != 0 || axis[0] * n[0] + axis[1] * n[1] + axis[2] * n[2] < least)
            return Error{ErrorCode::bad_attribute, offset, "5.7.1 a normal lies outside the chunk's normal cone"};
    }
    return {};
}

// Reads one decoded stream into its place and proves its values.
Status place_stream(Bytes raw, const StreamInfo &stream, const ChunkEntry &entry, std::uint64_t offset, int level,
                    const AttributeSet &set, std::size_t material_count, bool finest, Chunk &chunk) {
    PointAttributes &points = chunk.points;
    switch (stream.kind) {
    case StreamKind::masks: chunk.masks = std::move(raw); return check_masks(chunk.masks, entry);
    case StreamKind::normal:
        points.normals.resize(entry.shape.points);
        std::memcpy(points.normals.data(), raw.data(), raw.size());
        return check_normals(points.normals, entry.cone, offset);
    case StreamKind::radius:
        points.radii = std::move(raw);
        return finest ? check_values(points.radii, kMaxFinestRadius + 1U, offset,
                                     "6.2.2 a radius is more than 5 % of the grid's edge")
                      : Status{};
    case StreamKind::colour: points.colours = std::move(raw); return {};
    case StreamKind::material:
        points.materials = std::move(raw);
        return check_values(points.materials, static_cast<unsigned>(material_count), offset,
                            "6.4.1 a material index names no material");
    case StreamKind::texture: points.textures = std::move(raw); return {};
    case StreamKind::shadow: {
        const unsigned bits = set.shadow_bits[stream.light][static_cast<std::size_t>(level)];
        const std::size_t used = std::size_t{entry.shape.points} * bits % 8;
        if (used != 0 && raw.back() >> used != 0)
            return Error{ErrorCode::bad_attribute, offset, "6.6.1 bits after the last lit fraction are not zero"};
        Bytes &values = points.shadows[stream.light];
        values.resize(entry.shape.points);
        unpack_bits(raw, bits, values);
        return {};
    }
    }
    return {};
}

} // namespace

Result<Chunk> decode_chunk(const ChunkEntry &entry, ByteView stored, int level, const AttributeSet &set,
                           std::size_t material_count, bool finest) {
    assert(stored.size() == entry.stored_bytes);
    if (hash64(stored) != entry.hash)
        return Error{ErrorCode::bad_hash, entry.offset, "5.6.4 the chunk was changed: its hash does not match"};
    Chunk chunk;
    const std::vector<StreamInfo> streams = streams_of(set);
    std::size_t at = 0;
    for (std::size_t s = 0; s < streams.size(); ++s) {
        const StreamEntry &stream = entry.streams[s];
        Bytes raw(raw_stream_bytes(streams[s], set, level, entry.shape.nodes, entry.shape.points));
        const std::uint64_t offset = entry.offset + at;
        if (const Status status = decode_stream(stored.subspan(at, stream.stored_bytes), stream, raw, offset); !status)
            return status.error();
        if (const Status status =
                place_stream(std::move(raw), streams[s], entry, offset, level, set, material_count, finest, chunk);
            !status)
            return status.error();
        at += stream.stored_bytes;
    }
    return chunk;
}

void place_chunk(const Chunk &chunk, const ChunkEntry &entry, const AttributeSet &set, Level &level) {
    const auto copy = [](const auto &source, auto &target, std::uint64_t at) {
        std::copy(source.begin(), source.end(), target.begin() + static_cast<std::ptrdiff_t>(at));
    };
    const std::uint64_t first = entry.first_point;
    copy(chunk.masks, level.masks, entry.first_node);
    copy(chunk.points.normals, level.points.normals, first);
    copy(chunk.points.radii, level.points.radii, first);
    copy(chunk.points.colours, level.points.colours, first * static_cast<std::uint64_t>(set.colour_bytes()));
    copy(chunk.points.materials, level.points.materials, set.material ? first : 0);
    copy(chunk.points.textures, level.points.textures, set.texture ? first : 0);
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light)
        copy(chunk.points.shadows[light], level.points.shadows[light], first);
}

} // namespace pbm
