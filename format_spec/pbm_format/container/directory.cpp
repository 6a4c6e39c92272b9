// Decodes the chunk directory of a level. BVG.md 5.3 to 5.5
#include "pbm_format/container/layout.h"
#include "pbm_format/law/catalogue.h"

#include <algorithm>

namespace pbm {

StreamEntry unpack_stream_entry(std::uint32_t packed) {
    return {.stored_bytes = packed & 0xFFFFFF,
            .filter = static_cast<Filter>(packed >> 24 & 0x7F),
            .zstd = packed >> 31 != 0};
}

std::uint32_t pack_stream_entry(const StreamEntry &entry) {
    return entry.stored_bytes | static_cast<std::uint32_t>(entry.filter) << 24 | (entry.zstd ? 1U << 31 : 0U);
}

std::size_t chunk_entry_bytes(const AttributeSet &set) { return kChunkEntryFixedBytes + 4 * streams_of(set).size(); }

std::uint64_t decoded_bytes(const LevelDirectory &directory, const AttributeSet &set) {
    std::uint64_t per_point = 0;
    for (const StreamInfo &stream : streams_of(set))
        per_point += bytes_per_point(stream, set);
    return directory.nodes + directory.points * per_point;
}

namespace {

void read_chunk_entry(ByteReader &in, std::size_t stream_count, ChunkEntry &chunk) {
    chunk.shape.root_prefix = in.u64();
    chunk.hash = in.u64();
    chunk.shape.points = in.u32();
    chunk.shape.nodes = in.u32();
    chunk.shape.parents = in.u32();
    chunk.shape.bricks = in.u32();
    chunk.shape.parent_chunk = in.u32();
    chunk.cone.axis = in.u16();
    chunk.cone.cosine = in.i16();
    chunk.shape.root_depth = in.u8();
    in.zeros(7);
    chunk.streams.resize(stream_count);
    for (StreamEntry &stream : chunk.streams)
        stream = unpack_stream_entry(in.u32());
}

// Rules of one entry that depend only on the level and the chunk limit N. BVG.md 5.3
Status check_chunk_entry(const ChunkEntry &chunk, int level, std::uint32_t chunk_points, std::uint64_t at) {
    const ChunkShape &shape = chunk.shape;
    const auto range = [](std::uint64_t low, std::uint64_t high) {
        return std::to_string(low) + ".." + std::to_string(high);
    };
    if (shape.root_depth > std::max(0, level - 3))
        return broken("5.3.1", at + 40, "the chunk's root is too deep for its level",
                      "0.." + std::to_string(std::max(0, level - 3)), shape.root_depth);
    if (shape.root_prefix >> 3 * shape.root_depth != 0)
        return broken("5.3.2", at, "the chunk's root lies outside the grid",
                      "below 8^" + std::to_string(shape.root_depth), shape.root_prefix);
    if (shape.points == 0 || shape.points > chunk_points)
        return broken("5.3.3", at + 16, "the chunk holds no point or more than the limit", range(1, chunk_points),
                      shape.points);
    const auto fits = [](std::uint32_t children, std::uint32_t nodes) {
        return nodes >= 1 && nodes <= children && children <= std::uint64_t{8} * nodes;
    };
    const auto parents_of = [&](std::uint32_t children) { return range((children + 7) / 8, children); };
    if (!fits(shape.points, shape.nodes))
        return broken("5.3.4", at + 20, "node count is impossible for the point count", parents_of(shape.points),
                      shape.nodes);
    if (level >= 2 ? !fits(shape.nodes, shape.parents) : shape.parents != 0 || shape.nodes != 1)
        return broken("5.3.5", at + 24, "parent count is impossible for the node count",
                      level >= 2 ? parents_of(shape.nodes) : "0, of one node", shape.parents);
    if (level >= 3 ? !fits(shape.parents, shape.bricks) : shape.bricks != 1 || (level == 2 && shape.parents != 1))
        return broken("5.3.6", at + 28, "brick count is impossible for the parent count",
                      level >= 3 ? parents_of(shape.parents) : "1", shape.bricks);
    if (chunk.cone.axis >= kNormalCount || chunk.cone.cosine < kNoCone ||
        (chunk.cone.cosine == kNoCone && chunk.cone.axis != 0))
        return broken("5.3.7", at + 36, "the normal cone is out of range",
                      "axis below 8192, cosine at least -32767, axis 0 at -32767",
                      std::to_string(chunk.cone.axis) + ", " + std::to_string(chunk.cone.cosine));
    return {};
}

// 5.4.2 as text.
std::string possible_sizes(const StreamEntry &stream, Filter filter, std::uint64_t raw) {
    if (stream.filter == Filter::none && !stream.zstd)
        return std::to_string(raw);
    const std::uint64_t least = stream.filter == Filter::none ? 1 : kPlaneEntryBytes * plane_count(filter);
    return std::to_string(least) + " to less than " + std::to_string(raw) +
           (stream.filter == Filter::none ? "" : ", without zstd");
}

// Checks the stored sizes of the streams against their raw sizes. BVG.md 5.4
Status check_stream_sizes(const ChunkEntry &chunk, std::span<const StreamInfo> streams, int level,
                          const AttributeSet &set, std::uint64_t at) {
    for (std::size_t s = 0; s < streams.size(); ++s) {
        const StreamEntry &stream = chunk.streams[s];
        const std::uint64_t raw = raw_stream_bytes(streams[s], set, level, chunk.shape.nodes, chunk.shape.points);
        const std::uint64_t here = at + kChunkEntryFixedBytes + 4 * s;
        const auto says = [&](std::string_view what) { return std::string(to_string(streams[s].kind)).append(what); };
        const Filter filter = filter_of(streams[s], set);
        if (stream.filter != Filter::none && stream.filter != filter)
            return broken("5.4.1", here, says(": a filter this program does not know"),
                          "0 or " + std::to_string(static_cast<int>(filter)), static_cast<unsigned>(stream.filter));
        const bool possible = stream.filter != Filter::none
                                  ? !stream.zstd && stream.stored_bytes >= kPlaneEntryBytes * plane_count(filter) &&
                                        stream.stored_bytes < raw
                              : stream.zstd ? stream.stored_bytes != 0 && stream.stored_bytes < raw
                                            : stream.stored_bytes == raw;
        if (!possible)
            return broken("5.4.2", here, says(": stored size is impossible for the raw size"),
                          possible_sizes(stream, filter, raw), stream.stored_bytes);
        if (raw / kMaxExpansion > stream.stored_bytes)
            return broken("5.4.3", here, says(": expands more than 32,768 times"),
                          "at least " + std::to_string(raw / kMaxExpansion) + " bytes", stream.stored_bytes);
    }
    return {};
}

std::string sums(std::uint64_t stored, std::uint64_t raw, std::uint64_t points) {
    return std::to_string(stored) + " stored bytes, " + std::to_string(raw) + " raw, " + std::to_string(points) +
           " points";
}

// Bytes of the chunk in a mapped file. BVG.md 5.10.1
std::uint64_t mapped_bytes(const ChunkEntry &chunk) {
    std::uint64_t end = 0;
    for (const StreamEntry &stream : chunk.streams)
        end = align_stream(end + stream.stored_bytes);
    return end;
}

bool all_raw(const ChunkEntry &chunk) {
    return std::all_of(chunk.streams.begin(), chunk.streams.end(),
                       [](const StreamEntry &stream) { return stream.filter == Filter::none && !stream.zstd; });
}

} // namespace

Result<LevelDirectory> decode_directory(ByteView bytes, int level, const AttributeSet &set, std::uint32_t chunk_points,
                                        const LevelDirectory *above, const SectionEntry &section) {
    assert((level == 1) == (above == nullptr));
    const std::size_t entry_bytes = chunk_entry_bytes(set);
    if (bytes.empty() || bytes.size() % entry_bytes != 0)
        return broken("5.5.1", 0, "the directory is not a whole number of entries",
                      "a multiple of " + std::to_string(entry_bytes), bytes.size());
    const std::size_t count = bytes.size() / entry_bytes;
    const StreamList streams = streams_of(set);

    LevelDirectory directory;
    directory.level = level;
    directory.chunks.reserve(count);
    ByteReader in(bytes);
    const bool mapped = section.codec == Codec::raw;
    std::uint64_t offset = 0, raw_bytes = 0, parents = 0, bricks = 0;
    std::uint64_t next_place = 0;                      // first finest cell behind the previous chunk
    std::size_t parent_index = 0;                      // parent chunk that is being filled
    std::uint64_t parent_points = 0, parent_nodes = 0; // of the parent, covered by the chunks so far
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint64_t at = in.offset();
        ChunkEntry &chunk = directory.chunks.emplace_back();
        read_chunk_entry(in, streams.size(), chunk);
        if (!in.reserved_clear())
            return broken("5.5.2", at + 41, "reserved bytes are not zero", 0, in.reserved());
        if (const Status status = check_chunk_entry(chunk, level, chunk_points, at); !status)
            return status.error();
        if (const Status status = check_stream_sizes(chunk, {streams.begin(), streams.size()}, level, set, at); !status)
            return status.error();
        if (mapped && !all_raw(chunk))
            return broken("5.4.4", at + kChunkEntryFixedBytes, "a stream of a mapped file is filtered or compressed",
                          "raw");

        const int shift = 3 * (kMaxDepth - chunk.shape.root_depth);
        const std::uint64_t place = chunk.shape.root_prefix << shift;
        if (i > 0 && place < next_place)
            return broken("5.5.3", at, "chunks overlap or are not in Morton order",
                          "a root at or behind place " + std::to_string(next_place), place);
        next_place = place + (std::uint64_t{1} << shift);
        if (above == nullptr) {
            if (chunk.shape.parent_chunk != 0 || i > 0)
                return broken("5.5.4", at + 32, "level 1 is one chunk", "1 chunk with parent 0",
                              "chunk " + std::to_string(i) + " with parent " +
                                  std::to_string(chunk.shape.parent_chunk));
        } else {
            if (i > 0 && parent_points == above->chunks[parent_index].shape.points) {
                ++parent_index;
                parent_points = parent_nodes = 0;
            }
            if (parent_index >= above->chunks.size() || chunk.shape.parent_chunk != parent_index)
                return broken("5.5.5", at + 32, "parent chunks are not filled one after the other",
                              parent_index < above->chunks.size() ? Value(parent_index) : Value("none: all are full"),
                              chunk.shape.parent_chunk);
            const ChunkShape &parent = above->chunks[parent_index].shape;
            if (chunk.shape.root_depth < parent.root_depth ||
                chunk.shape.root_prefix >> 3 * (chunk.shape.root_depth - parent.root_depth) != parent.root_prefix)
                return broken("5.5.6", at, "the chunk does not nest in its parent chunk",
                              "below node " + std::to_string(parent.root_prefix) + " of level " +
                                  std::to_string(parent.root_depth),
                              "node " + std::to_string(chunk.shape.root_prefix) + " of level " +
                                  std::to_string(chunk.shape.root_depth));
            parent_points += chunk.shape.nodes;
            parent_nodes += chunk.shape.parents;
            if (parent_points > parent.points || parent_nodes > parent.nodes ||
                (parent_points == parent.points) != (parent_nodes == parent.nodes))
                return broken("5.5.7", at + 20, "chunks hold more nodes than their parent chunk has points",
                              std::to_string(parent.points) + " nodes, " + std::to_string(parent.nodes) + " parents",
                              std::to_string(parent_points) + " nodes, " + std::to_string(parent_nodes) +
                                  " parents so far");
        }
        chunk.offset = section.offset + offset;
        chunk.first_point = directory.points;
        chunk.first_node = directory.nodes;
        chunk.first_parent = parents;
        chunk.first_brick = bricks;
        parents += chunk.shape.parents;
        bricks += chunk.shape.bricks;
        for (std::size_t s = 0; s < streams.size() && !mapped; ++s) {
            chunk.stored_bytes += chunk.streams[s].stored_bytes;
            raw_bytes += raw_stream_bytes(streams[s], set, level, chunk.shape.nodes, chunk.shape.points);
        }
        if (mapped) {
            chunk.stored_bytes = mapped_bytes(chunk);
            raw_bytes += chunk.stored_bytes;
        }
        if (chunk.stored_bytes > section.stored_bytes - offset)
            return broken("5.5.8", at + kChunkEntryFixedBytes, "the chunk lies outside its section",
                          "at most " + std::to_string(section.stored_bytes - offset), chunk.stored_bytes);
        offset += chunk.stored_bytes;
        directory.points += chunk.shape.points;
        directory.nodes += chunk.shape.nodes;
    }
    if (above != nullptr &&
        (parent_index + 1 != above->chunks.size() || parent_points != above->chunks.back().shape.points))
        return broken("5.5.9", bytes.size(), "points of the level above have no masks", above->points, directory.nodes);
    if (offset != section.stored_bytes || raw_bytes != section.raw_bytes || directory.points != section.count)
        return broken("5.5.10", bytes.size(), "sums over the chunks are not those of the section table",
                      sums(section.stored_bytes, section.raw_bytes, section.count),
                      sums(offset, raw_bytes, directory.points));
    return directory;
}

} // namespace pbm
