#include "pbm_format/chunks/point_stream_chunk.h"

#include "pbm_format/hashes/hash.h"
#include "pbm_format/law/catalogue.h"
#include "pbm_format/streams/frame.h"

#include <algorithm>
#include <bit>

namespace pbm {
namespace {

std::uint64_t mask_bytes(std::uint64_t points) { return (points + 7) / 8; }

// The part of a list of points that belongs to a chunk.
struct PointsOfChunk {
    std::size_t first = 0, count = 0;
};

// `points`: indices within the level, ascending.
PointsOfChunk points_of(std::span<const std::uint32_t> points, const ChunkEntry &entry) {
    const auto at = [&](std::uint64_t point) {
        return static_cast<std::size_t>(std::lower_bound(points.begin(), points.end(), point) - points.begin());
    };
    const std::size_t first = at(entry.first_point);
    return {first, at(entry.first_point + entry.shape.points) - first};
}

// The mask of these points, which belong to the chunk.
Bytes encode_mask(std::span<const std::uint32_t> points, const ChunkEntry &entry) {
    Bytes mask(static_cast<std::size_t>(mask_bytes(entry.shape.points)), 0);
    for (const std::uint32_t point : points) {
        const auto place = static_cast<std::size_t>(point - entry.first_point);
        mask[place / 8] |= static_cast<std::uint8_t>(1U << place % 8);
    }
    return mask;
}

// Lists the points that the mask at the start of `raw` marks, as indices within the chunk. False: there is no whole
// mask, or it marks no point, or one that the chunk does not have.
bool read_mask(ByteView raw, std::uint32_t chunk_points, std::vector<std::uint32_t> &to) {
    to.clear();
    const auto bytes = static_cast<std::size_t>(mask_bytes(chunk_points));
    if (raw.size() < bytes)
        return false;
    for (std::size_t byte = 0; byte < bytes; ++byte)
        for (unsigned left = raw[byte]; left != 0; left &= left - 1)
            to.push_back(static_cast<std::uint32_t>(8 * byte) + static_cast<std::uint32_t>(std::countr_zero(left)));
    return !to.empty() && to.back() < chunk_points;
}

// The raw bytes of the stream: 19.3.1 and 5.6.
Result<Bytes> decode_stream_values(const PointStreamEntry &entry, ByteView stored, PointStream kind, Wording wording) {
    if (const std::uint64_t hash = hash64(stored); hash != entry.hash)
        return broken(wording, "19.3.1", entry.offset,
                      kind == PointStream::sides ? "the sides of the chunk were changed: their hash does not match"
                                                 : "the offsets of the chunk were changed: their hash does not match",
                      hash_value(entry.hash), hash_value(hash));
    Bytes raw(entry.raw_bytes);
    if (raw.empty())
        return raw;
    if (Status status = decode_frame(stored, entry.zstd, raw, entry.offset, wording); !status)
        return std::move(status).error();
    return raw;
}

std::uint64_t raw_bytes(std::uint64_t chunk_points, std::uint64_t marked, const AttributeSet &set, int level) {
    std::uint64_t bytes = mask_bytes(chunk_points);
    for (const StreamInfo &stream : side_streams(set))
        bytes += raw_stream_bytes(stream, set, level, 0, 2 * marked);
    return bytes;
}

// Reads one stream of both sides of `to.points`.
Status read_side_stream(const StreamInfo &stream, ByteView raw, const ChunkRules &rules, std::uint64_t offset,
                        Sides &to) {
    const auto count = static_cast<std::uint32_t>(2 * to.size());
    if (stream.kind == StreamKind::normal) {
        std::vector<std::uint16_t> &normals = to.values.normals;
        normals.resize(count);
        std::uint16_t bits = 0;
        for (std::size_t i = 0; i < count; ++i)
            bits |= normals[i] = static_cast<std::uint16_t>(raw[2 * i] | raw[2 * i + 1] << 8);
        if ((bits & ~kNormalIndexMask) != 0)
            return broken(
                rules.wording, "19.4.2", offset, "the normal of a side is two-sided or has reserved bits", "below 8192",
                *std::find_if(normals.begin(), normals.end(), [](std::uint16_t n) { return n > kNormalIndexMask; }));
        return {};
    }
    Bytes &values = to.values.values(stream);
    if (stream.kind != StreamKind::shadow) {
        values.assign(raw.begin(), raw.end());
        return check_values(stream, values, rules, offset);
    }
    const unsigned bits = bits_per_point(stream, rules.set, rules.level);
    values.resize(count);
    unpack_bits(raw, bits, values);
    return check_packed_tail(raw, count, bits, offset, rules.wording);
}

} // namespace

StreamList side_streams(const AttributeSet &set) {
    StreamList streams;
    for (const StreamInfo &stream : streams_of(set))
        if (stream.kind != StreamKind::masks && stream.kind != StreamKind::radius)
            streams.add(stream.kind, stream.light);
    return streams;
}

Bytes encode_sides(const Sides &sides, const ChunkEntry &entry, const AttributeSet &set, int level) {
    const auto [first, count] = points_of(sides.points, entry);
    if (count == 0)
        return {};
    Bytes raw = encode_mask(std::span(sides.points).subspan(first, count), entry);
    for (const StreamInfo &stream : side_streams(set)) {
        if (stream.kind == StreamKind::normal) {
            for (const std::uint16_t normal : std::span(sides.values.normals).subspan(2 * first, 2 * count)) {
                raw.push_back(static_cast<std::uint8_t>(normal));
                raw.push_back(static_cast<std::uint8_t>(normal >> 8));
            }
            continue;
        }
        const std::size_t width = bytes_per_point(stream, set);
        const ByteView values = slice(sides.values.values(stream), 2 * width * first, 2 * width * count);
        const Bytes packed = stream.kind == StreamKind::shadow ? pack_bits(values, bits_per_point(stream, set, level))
                                                               : Bytes(values.begin(), values.end());
        raw.insert(raw.end(), packed.begin(), packed.end());
    }
    return raw;
}

Status decode_sides(const PointStreamEntry &entry, ByteView stored, const ChunkEntry &chunk, const ChunkRules &rules,
                    Sides &to) {
    to = {};
    const Result<Bytes> values = decode_stream_values(entry, stored, PointStream::sides, rules.wording);
    if (!values)
        return values.error();
    if (values->empty())
        return {};
    const ByteView raw = *values;
    const std::uint32_t points = chunk.shape.points;
    const bool is_mask = read_mask(raw, points, to.points);
    if (!is_mask || raw.size() != raw_bytes(points, to.size(), rules.set, rules.level))
        return broken(rules.wording, "19.4.1", entry.offset,
                      "the sides are not a mask of the chunk's points and the values of both sides of those it marks",
                      is_mask ? Value(raw_bytes(points, to.size(), rules.set, rules.level)) : Value("a mask"),
                      raw.size());
    if (chunk.cone.cosine != kNoCone)
        return broken(rules.wording, "19.4.3", entry.offset, "a chunk whose points have sides has a normal cone",
                      kNoCone, chunk.cone.cosine);
    std::size_t at = static_cast<std::size_t>(mask_bytes(points));
    for (const StreamInfo &stream : side_streams(rules.set)) {
        const auto bytes = static_cast<std::size_t>(raw_stream_bytes(stream, rules.set, rules.level, 0, 2 * to.size()));
        if (Status status = read_side_stream(stream, raw.subspan(at, bytes), rules, entry.offset, to); !status)
            return status;
        at += bytes;
    }
    return {};
}

Bytes encode_offsets(const Offsets &offsets, const ChunkEntry &entry) {
    const auto [first, count] = points_of(offsets.points, entry);
    if (count == 0)
        return {};
    Bytes raw = encode_mask(std::span(offsets.points).subspan(first, count), entry);
    const auto values = std::span(offsets.values).subspan(first, count);
    raw.insert(raw.end(), values.begin(), values.end());
    return raw;
}

Status decode_offsets(const PointStreamEntry &entry, ByteView stored, std::uint32_t chunk_points, Wording wording,
                      Offsets &to) {
    to = {};
    const Result<Bytes> raw = decode_stream_values(entry, stored, PointStream::offsets, wording);
    if (!raw)
        return raw.error();
    if (raw->empty())
        return {};
    const bool is_mask = read_mask(*raw, chunk_points, to.points);
    const std::uint64_t whole = mask_bytes(chunk_points) + to.size();
    if (!is_mask || raw->size() != whole)
        return broken(wording, "19.6.1", entry.offset,
                      "the offsets are not a mask of the chunk's points and a byte for each that it marks",
                      is_mask ? Value(whole) : Value("a mask"), raw->size());
    to.values.assign(raw->end() - static_cast<std::ptrdiff_t>(to.size()), raw->end());
    const auto [least, most] = std::minmax_element(to.values.begin(), to.values.end());
    if (*least < -Offsets::kMost || *most > Offsets::kMost)
        return broken(wording, "19.6.2", entry.offset, "an offset is beyond the voxel", "-14..14",
                      static_cast<int>(*least < -Offsets::kMost ? *least : *most));
    return {};
}

} // namespace pbm
