// The chunk directory of a level. BVG.md 5.3 to 5.5.
#include "pbm_format/layout.h"

#include <algorithm>

namespace pbm {

std::size_t chunk_entry_bytes(const AttributeSet &set) { return kChunkEntryFixedBytes + 4 * streams_of(set).size(); }

std::uint64_t decoded_bytes(const LevelDirectory &directory, const AttributeSet &set) {
    const int per_point = 3 + set.colour_bytes() + (set.material ? 1 : 0) + (set.texture ? 1 : 0) + set.lights;
    return directory.nodes + directory.points * static_cast<std::uint64_t>(per_point);
}

Bytes encode_directory(const LevelDirectory &directory, const AttributeSet &set) {
    ByteWriter out;
    for (const ChunkEntry &chunk : directory.chunks) {
        assert(chunk.streams.size() == streams_of(set).size());
        out.u64(chunk.shape.root_prefix);
        out.u64(chunk.hash);
        out.u32(chunk.shape.points);
        out.u32(chunk.shape.nodes);
        out.u32(chunk.shape.parents);
        out.u32(chunk.shape.bricks);
        out.u32(chunk.shape.parent_chunk);
        out.u16(chunk.cone.axis);
        out.i16(chunk.cone.cosine);
        out.u8(chunk.shape.root_depth);
        out.zeros(7);
        for (const StreamEntry &stream : chunk.streams)
            out.u32(stream.stored_bytes | static_cast<std::uint32_t>(stream.filter) << 24 |
                    (stream.zstd ? 1U << 31 : 0U));
    }
    static_cast<void>(set);
    return out.take();
}

namespace {

ChunkEntry read_chunk_entry(ByteReader &in, std::size_t stream_count) {
    ChunkEntry chunk;
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
    for (StreamEntry &stream : chunk.streams) {
        const std::uint32_t packed = in.u32();
        stream.stored_bytes = packed & 0xFFFFFF;
        stream.filter = static_cast<Filter>(packed >> 24 & 0x7F);
        stream.zstd = packed >> 31 != 0;
    }
    return chunk;
}

// Rules of one entry that need nothing but the level and N. BVG.md 5.3
Status check_chunk_entry(const ChunkEntry &chunk, int level, std::uint32_t chunk_points, std::uint64_t at) {
    const ChunkShape &shape = chunk.shape;
    const auto bad = [&](std::uint64_t field, const char *message) {
        return Error{ErrorCode::bad_directory, at + field, message};
    };
    if (shape.root_depth > std::max(0, level - 3))
        return bad(40, "5.3.1 the chunk's root is too deep for its level");
    if (shape.root_prefix >> 3 * shape.root_depth != 0)
        return bad(0, "5.3.2 the chunk's root lies outside the grid");
    if (shape.points == 0 || shape.points > chunk_points)
        return bad(16, "5.3.3 the chunk holds no point or more than the limit");
    const auto fits = [](std::uint32_t children, std::uint32_t nodes) {
        return nodes >= 1 && nodes <= children && children <= std::uint64_t{8} * nodes;
    };
    if (!fits(shape.points, shape.nodes))
        return bad(20, "5.3.4 node count is impossible for the point count");
    if (level >= 2 ? !fits(shape.nodes, shape.parents) : shape.parents != 0 || shape.nodes != 1)
        return bad(24, "5.3.5 parent count is impossible for the node count");
    if (level >= 3 ? !fits(shape.parents, shape.bricks) : shape.bricks != 1 || (level == 2 && shape.parents != 1))
        return bad(28, "5.3.6 brick count is impossible for the parent count");
    if (chunk.cone.axis >= kNormalCount || chunk.cone.cosine < kNoCone ||
        (chunk.cone.cosine == kNoCone && chunk.cone.axis != 0))
        return bad(36, "5.3.7 the normal cone is out of range");
    return {};
}

// Sizes of the streams against what they expand to. BVG.md 5.4
Status check_stream_sizes(const ChunkEntry &chunk, int level, const AttributeSet &set, std::uint64_t at) {
    const std::vector<StreamInfo> streams = streams_of(set);
    for (std::size_t s = 0; s < streams.size(); ++s) {
        const StreamEntry &stream = chunk.streams[s];
        const std::uint64_t raw = raw_stream_bytes(streams[s], set, level, chunk.shape.nodes, chunk.shape.points);
        const std::uint64_t here = at + kChunkEntryFixedBytes + 4 * s;
        const std::string name(to_string(streams[s].kind));
        const Filter filter = filter_of(streams[s], set);
        if (stream.filter != Filter::none && stream.filter != filter)
            return Error{ErrorCode::unsupported_feature, here,
                         "5.4.1 " + name + ": a filter this program does not know"};
        const bool possible = stream.filter != Filter::none
                                  ? !stream.zstd && stream.stored_bytes >= kPlaneEntryBytes * plane_count(filter) &&
                                        stream.stored_bytes < raw
                              : stream.zstd ? stream.stored_bytes != 0 && stream.stored_bytes < raw
                                            : stream.stored_bytes == raw;
        if (!possible)
            return Error{ErrorCode::bad_directory, here,
                         "5.4.2 " + name + ": stored size is impossible for the raw size"};
        if (raw / kMaxExpansion > stream.stored_bytes)
            return Error{ErrorCode::too_large, here, "5.4.3 " + name + ": expands more than 32,768 times"};
    }
    return {};
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
        return Error{ErrorCode::bad_directory, 0, "5.5.1 the directory is not a whole number of entries"};
    const std::size_t count = bytes.size() / entry_bytes;
    const std::vector<StreamInfo> streams = streams_of(set);

    LevelDirectory directory;
    directory.level = level;
    directory.chunks.reserve(count);
    ByteReader in(bytes);
    const bool mapped = section.codec == Codec::raw;
    std::uint64_t offset = 0, raw_bytes = 0, parents = 0, bricks = 0;
    std::uint64_t next_place = 0;                      // first finest cell after the chunk before
    std::size_t parent_index = 0;                      // chunk above that is being filled
    std::uint64_t parent_points = 0, parent_nodes = 0; // of it that the chunks so far hold
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint64_t at = in.offset();
        const auto bad = [&](std::uint64_t field, const char *message) {
            return Error{ErrorCode::bad_directory, at + field, message};
        };
        ChunkEntry chunk = read_chunk_entry(in, streams.size());
        if (!in.reserved_clear())
            return bad(41, "5.5.2 reserved bytes are not zero");
        if (const Status status = check_chunk_entry(chunk, level, chunk_points, at); !status)
            return status.error();
        if (const Status status = check_stream_sizes(chunk, level, set, at); !status)
            return status.error();
        if (mapped && !all_raw(chunk))
            return bad(kChunkEntryFixedBytes, "5.4.4 a stream of a mapped file is filtered or compressed");

        const int shift = 3 * (kMaxDepth - chunk.shape.root_depth);
        const std::uint64_t place = chunk.shape.root_prefix << shift;
        if (i > 0 && place < next_place)
            return bad(0, "5.5.3 chunks overlap or are not in Morton order");
        next_place = place + (std::uint64_t{1} << shift);
        if (above == nullptr) {
            if (chunk.shape.parent_chunk != 0 || i > 0)
                return bad(32, "5.5.4 level 1 is one chunk");
        } else {
            if (i > 0 && parent_points == above->chunks[parent_index].shape.points) {
                ++parent_index;
                parent_points = parent_nodes = 0;
            }
            if (parent_index >= above->chunks.size() || chunk.shape.parent_chunk != parent_index)
                return bad(32, "5.5.5 parent chunks are not filled one after the other");
            const ChunkShape &parent = above->chunks[parent_index].shape;
            if (chunk.shape.root_depth < parent.root_depth ||
                chunk.shape.root_prefix >> 3 * (chunk.shape.root_depth - parent.root_depth) != parent.root_prefix)
                return bad(0, "5.5.6 the chunk does not nest in its parent chunk");
            parent_points += chunk.shape.nodes;
            parent_nodes += chunk.shape.parents;
            if (parent_points > parent.points || parent_nodes > parent.nodes ||
                (parent_points == parent.points) != (parent_nodes == parent.nodes))
                return bad(20, "5.5.7 chunks hold more nodes than their parent chunk has points");
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
            return bad(kChunkEntryFixedBytes, "5.5.8 the chunk lies outside its section");
        offset += chunk.stored_bytes;
        directory.points += chunk.shape.points;
        directory.nodes += chunk.shape.nodes;
        directory.chunks.push_back(std::move(chunk));
    }
    if (above != nullptr &&
        (parent_index + 1 != above->chunks.size() || parent_points != above->chunks.back().shape.points))
        return Error{ErrorCode::bad_directory, bytes.size(), "5.5.9 points of the level above have no masks"};
    if (offset != section.stored_bytes || raw_bytes != section.raw_bytes || directory.points != section.count)
        return Error{ErrorCode::bad_directory, bytes.size(),
                     "5.5.10 sums over the chunks are not those of the section table"};
    return directory;
}

} // namespace pbm
