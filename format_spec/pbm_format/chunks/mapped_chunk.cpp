#include "pbm_format/chunks/mapped_chunk.h"

#include "pbm_format/hashes/hash.h"
#include "pbm_format/law/catalogue.h"
#include "system/threads/per_thread.h"

#include <algorithm>

namespace pbm {

namespace {

// Calls `visit(stream, place, bytes)` for each stream; `place` counts from the chunk's start.
template <class Visit> void for_streams(const ChunkEntry &entry, const AttributeSet &set, Visit &&visit) {
    std::uint64_t at = 0;
    const StreamList streams = streams_of(set);
    for (std::size_t s = 0; s < streams.size(); ++s) {
        visit(streams[s], at, std::uint64_t{entry.streams[s].stored_bytes});
        at = align_stream(at + entry.streams[s].stored_bytes);
    }
}

// Views bytes of a file as `count` records of T.
template <class T> std::span<const T> view_as(ByteView bytes, std::size_t count) {
    assert(bytes.size() >= count * sizeof(T));
    assert(reinterpret_cast<std::uintptr_t>(bytes.data()) % alignof(T) == 0);
    return {reinterpret_cast<const T *>(bytes.data()), count};
}

} // namespace

FileRange brick_range(const ChunkEntry &entry, const SectionEntry &bricks) {
    return {bricks.offset + entry.first_brick * kBrickRecordBytes, entry.shape.bricks * kBrickRecordBytes};
}

ChunkView view_chunk(const ChunkEntry &entry, const ChunkBytes &stored, const AttributeSet &set, int level) {
    ChunkView view;
    view.owners = {stored.streams.owner, stored.bricks.owner};
    for_streams(entry, set, [&](const StreamInfo &stream, std::uint64_t at, std::uint64_t size) {
        const ByteView bytes = slice(stored.streams.bytes, at, size);
        assert(size == raw_stream_bytes(stream, set, level, entry.shape.nodes, entry.shape.points));
        if (stream.kind == StreamKind::masks)
            view.masks = bytes;
        else if (stream.kind == StreamKind::normal)
            view.normals = view_as<std::uint16_t>(bytes, entry.shape.points);
        else
            view.values(stream) = bytes;
    });
    view.bricks = view_as<BrickRecord>(stored.bricks.bytes, entry.shape.bricks);
    static_cast<void>(level);
    return view;
}

namespace {

// Per thread, so that verifying needs no allocation.
struct ProofScratch {
    OutsideCone outside;
    std::vector<BrickRecord> bricks;
};

Status check_padding(const ChunkEntry &entry, ByteView stored, const AttributeSet &set) {
    Status status;
    for_streams(entry, set, [&](const StreamInfo &, std::uint64_t at, std::uint64_t size) {
        for (std::uint64_t byte = at + size; byte < align_stream(at + size); ++byte)
            if (const ByteView padding = slice(stored, byte, 1); status && padding[0] != 0)
                status = broken("5.10.1", entry.offset + byte, "padding of a mapped chunk is not zero", 0, padding[0]);
    });
    return status;
}

Status check_streams(const ChunkEntry &entry, const ChunkView &view, const ChunkRules &rules, OutsideCone &memory) {
    Status status = check_masks(summarise_masks(view.masks), entry.shape.points, entry.offset, rules.wording);
    for_streams(entry, rules.set, [&](const StreamInfo &stream, std::uint64_t at, std::uint64_t) {
        const std::uint64_t offset = entry.offset + at;
        if (!status)
            return;
        if (stream.kind == StreamKind::normal) {
            status = check_normals(view.normals, offset, rules.wording);
            if (status)
                status = check_cone(view.normals, entry.cone, memory, offset, rules.wording);
        } else if (stream.kind == StreamKind::shadow) {
            status = check_packed_tail(view.values(stream), entry.shape.points,
                                       bits_per_point(stream, rules.set, rules.level), offset, rules.wording);
        } else if (stream.kind != StreamKind::masks) {
            status = check_values(stream, view.values(stream), rules, offset);
        }
    });
    return status;
}

std::string list(std::initializer_list<int> numbers) {
    std::string text;
    for (const int number : numbers)
        text += (text.empty() ? "" : ", ") + std::to_string(number);
    return text;
}

// The error for the first field of a record that differs, with its rule and offset.
Error describe_difference(const BrickRecord &stored, const BrickRecord &expected, std::uint64_t offset) {
    const auto place = [](const BrickRecord &brick) { return list({brick.x, brick.y, brick.z}); };
    const auto first = [](const BrickRecord &brick) { return list({brick.first_point, brick.first_node}); };
    const auto cone = [](const BrickRecord &brick) { return list({brick.cone_axis, brick.cone_cosine}); };
    const auto bounds = [](const BrickRecord &brick) { return list({brick.largest_radius, brick.flags}); };
    if (place(stored) != place(expected))
        return broken("5.11.2", offset + offsetof(BrickRecord, x), "the brick stands elsewhere", place(expected),
                      place(stored));
    if (first(stored) != first(expected))
        return broken("5.11.2", offset + offsetof(BrickRecord, first_point),
                      "the brick's points or masks start elsewhere", first(expected), first(stored));
    if (stored.node_map != expected.node_map)
        return broken("5.11.2", offset + offsetof(BrickRecord, node_map),
                      "the brick's node map is not that of the octree", hash_value(expected.node_map),
                      hash_value(stored.node_map));
    if (cone(stored) != cone(expected))
        return broken("5.11.3", offset + offsetof(BrickRecord, cone_axis),
                      "the brick's normal cone is not that of its points", cone(expected), cone(stored));
    return broken("5.11.4", offset + offsetof(BrickRecord, largest_radius),
                  "the brick's radius or flags are not those of its points", bounds(expected), bounds(stored));
}

Status check_bricks(const ChunkEntry &entry, const ChunkView &view, const SectionEntry &section, int level,
                    const BrickParents &parents, std::vector<BrickRecord> &expected) {
    expected.resize(entry.shape.bricks);
    if (!index_bricks(parents, entry.shape, level, view.masks, view.normals, view.radii, expected))
        return broken("5.11.1", entry.offset,
                      "the chunk does not hold whole bricks, as many as the directory says, below its root",
                      entry.shape.bricks);
    const auto differ = std::mismatch(expected.begin(), expected.end(), view.bricks.begin());
    if (differ.first == expected.end())
        return {};
    const auto index = entry.first_brick + static_cast<std::uint64_t>(differ.first - expected.begin());
    return describe_difference(*differ.second, *differ.first, section.offset + index * kBrickRecordBytes);
}

} // namespace

Status verify_chunk(const ChunkEntry &entry, const ChunkBytes &bytes, const SectionEntry &bricks,
                    const ChunkRules &rules, const BrickParents &parents) {
    auto &scratch = per_thread<ProofScratch>();
    if (const std::uint64_t hash = hash64(bytes.streams.bytes); hash != entry.hash)
        return broken(rules.wording, "5.6.4", entry.offset, "the chunk was changed: its hash does not match",
                      hash_value(entry.hash), hash_value(hash));
    const ChunkView view = view_chunk(entry, bytes, rules.set, rules.level);
    Status status = check_padding(entry, bytes.streams.bytes, rules.set);
    if (status)
        status = check_streams(entry, view, rules, scratch.outside);
    if (status)
        status = check_bricks(entry, view, bricks, rules.level, parents, scratch.bricks);
    return status;
}

void copy_chunk(const ChunkView &view, const AttributeSet &set, int level, Chunk &to) {
    to.masks.assign(view.masks.begin(), view.masks.end());
    to.points.resize(view.normals.size(), set);
    for (const StreamInfo &stream : streams_of(set)) {
        if (stream.kind == StreamKind::masks)
            continue;
        const std::span<std::uint8_t> column = bytes_of(to.points, stream);
        if (stream.kind == StreamKind::shadow) {
            unpack_bits(view.values(stream), bits_per_point(stream, set, level), column);
        } else {
            const ByteView stored = bytes_of(view, stream);
            std::copy(stored.begin(), stored.end(), column.begin());
        }
    }
}

} // namespace pbm
