#include "pbm_format/chunks/side_chunk.h"

#include "pbm_format/chunks/stream_values.h"

#include <algorithm>

namespace pbm {
namespace {

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

} // namespace pbm
