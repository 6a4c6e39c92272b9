#include "pbm_format/writing/chunk_encoder.h"

#include "pbm_format/chunks/chunk.h"
#include "pbm_format/chunks/normal_cone.h"
#include "pbm_format/chunks/point_stream_chunk.h"
#include "pbm_format/writing/frame_encoder.h"
#include "pbm_format/writing/stream_filter.h"
#include "system/threads/per_thread.h"

#include <cassert>
#include <utility>

namespace pbm {

Bytes raw_stream(const StreamContext &context, ByteView masks, const PointView &points) {
    const StreamInfo &stream = context.stream;
    if (stream.kind == StreamKind::shadow)
        return pack_bits(points.values(stream), bits_per_point(stream, context.set, context.level));
    const ByteView bytes = stream.kind == StreamKind::masks ? masks : bytes_of(points, stream);
    return {bytes.begin(), bytes.end()};
}

std::vector<ChunkEntry> place_chunks(std::span<const ChunkShape> shapes) {
    std::vector<ChunkEntry> chunks;
    chunks.reserve(shapes.size());
    std::uint64_t parent = 0, node = 0, point = 0;
    for (const ChunkShape &shape : shapes) {
        ChunkEntry &chunk = chunks.emplace_back();
        chunk.shape = shape;
        chunk.first_parent = std::exchange(parent, parent + shape.parents);
        chunk.first_node = std::exchange(node, node + shape.nodes);
        chunk.first_point = std::exchange(point, point + shape.points);
    }
    return chunks;
}

namespace {

// Whether a search for matches in the plain stream can pay: not if it has twice the filtered size without them.
bool may_become_smaller(std::size_t plain, std::size_t filtered) { return plain / 2 < filtered; }

// Appends the smaller of the plain stream `raw` and the filtered one, whose planes may be absent.
StreamEntry append_smaller(ByteView raw, const std::optional<std::vector<Bytes>> &planes, Filter filter,
                           const ChunkCoding &coding, Bytes &out) {
    struct Coded {
        Bytes plain, filtered;
    };
    Coded &coded = per_thread<Coded>();
    Bytes &plain = coded.plain, &filtered = coded.filtered;
    filtered.clear();
    if (planes)
        append_planes(*planes, coding.compression_level, filtered);
    const auto store_plain = [&](int level) {
        plain.clear();
        const StoredFrame frame = append_frame(raw, level, plain);
        return StreamEntry{.stored_bytes = frame.stored_bytes, .filter = Filter::none, .zstd = frame.zstd};
    };
    StreamEntry entry = store_plain(planes ? 1 : coding.compression_level);
    if (planes && coding.compression_level > 1 && may_become_smaller(plain.size(), filtered.size()))
        entry = store_plain(coding.compression_level);
    if (planes && filtered.size() < plain.size())
        entry = {.stored_bytes = static_cast<std::uint32_t>(filtered.size()), .filter = filter, .zstd = false};
    const Bytes &stored = entry.filter == Filter::none ? plain : filtered;
    out.insert(out.end(), stored.begin(), stored.end());
    return entry;
}

StreamEntry append_stream(const StreamContext &context, ByteView masks, const PointView &points,
                          const ChunkNodes &nodes, const ChunkCoding &coding, Bytes &out) {
    return append_smaller(raw_stream(context, masks, points),
                          coding.filters ? filter_stream(context, masks, points, nodes) : std::nullopt,
                          filter_of(context.stream, context.set), coding, out);
}

// Appends the raw stream, padded with zeros to the alignment of mapped streams. The chunk starts at `start` in `out`.
StreamEntry append_aligned(const StreamContext &context, ByteView masks, const PointView &points, std::size_t start,
                           Bytes &out) {
    const Bytes raw = raw_stream(context, masks, points);
    out.insert(out.end(), raw.begin(), raw.end());
    out.resize(start + align_stream(out.size() - start), 0);
    return {.stored_bytes = static_cast<std::uint32_t>(raw.size())};
}

} // namespace

void encode_chunk(const Model &model, int level, const ChunkCoding &coding, ChunkEntry &entry, Bytes &out) {
    assert(level >= 1);
    const AttributeSet &set = model.parameters.attributes;
    const Level &here = model.levels[static_cast<std::size_t>(level)];
    const Level &above = model.levels[static_cast<std::size_t>(level) - 1];
    const ChunkNodes nodes = chunk_nodes(entry, above.masks, 0, above.points, 0, set);
    const ByteView masks = ByteView(here.masks).subspan(entry.first_node, entry.shape.nodes);
    const PointView points = view_points(here.points, entry.first_point, entry.shape.points, set);
    const bool finest = static_cast<std::size_t>(level) + 1 == model.levels.size();
    entry.cone = bound_normals(points.normals);
    entry.streams.clear();
    const std::size_t start = out.size();
    for (const StreamInfo &stream : streams_of(set)) {
        const StreamContext context{.set = set, .stream = stream, .level = level, .finest = finest};
        entry.streams.push_back(coding.storage == Storage::mapped
                                    ? append_aligned(context, masks, points, start, out)
                                    : append_stream(context, masks, points, nodes, coding, out));
    }
    entry.stored_bytes = out.size() - start;
    entry.hash = hash64(ByteView(out).subspan(start));
}

FieldEntry encode_field(const Model &model, int level, std::size_t field, const ChunkEntry &chunk,
                        const ChunkCoding &coding, Bytes &out) {
    const Field &kind = model.parameters.fields[field];
    const Level &here = model.levels[static_cast<std::size_t>(level)];
    const Level &above = model.levels[static_cast<std::size_t>(level) - 1];
    const auto values = [&](const Level &of, std::uint64_t first, std::uint64_t count) {
        return slice(of.fields[field], kind.bytes * first, kind.bytes * count);
    };
    const ByteView points = values(here, chunk.first_point, chunk.shape.points);
    const std::size_t start = out.size();
    FieldEntry entry;
    if (coding.storage == Storage::mapped) {
        out.insert(out.end(), points.begin(), points.end());
        entry.stream.stored_bytes = static_cast<std::uint32_t>(points.size());
    } else {
        const auto planes = coding.filters ? filter_field(kind, slice(here.masks, chunk.first_node, chunk.shape.nodes),
                                                          points, values(above, chunk.first_node, chunk.shape.nodes))
                                           : std::nullopt;
        entry.stream = append_smaller(points, planes, filter_of(kind), coding, out);
    }
    entry.hash = hash64(ByteView(out).subspan(start));
    return entry;
}

PointStreamEntry encode_point_stream(const Model &model, int level, PointStream kind, const ChunkCoding &coding,
                                     ChunkEntry &chunk, Bytes &out) {
    const Level &here = model.levels[static_cast<std::size_t>(level)];
    const Bytes raw = kind == PointStream::sides ? encode_sides(here.sides, chunk, model.parameters.attributes, level)
                                                 : encode_offsets(here.offsets, chunk);
    PointStreamEntry entry{.raw_bytes = static_cast<std::uint32_t>(raw.size())};
    const std::size_t start = out.size();
    if (coding.storage == Storage::mapped || raw.empty()) {
        out.insert(out.end(), raw.begin(), raw.end());
    } else {
        entry.zstd = append_frame(raw, coding.compression_level, out).zstd;
    }
    if (kind == PointStream::sides && !raw.empty())
        chunk.cone = {};
    entry.stored_bytes = static_cast<std::uint32_t>(out.size() - start);
    entry.hash = hash64(ByteView(out).subspan(start));
    return entry;
}

} // namespace pbm
