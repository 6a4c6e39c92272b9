#include "pbm_format/chunks/field_chunk.h"

#include "pbm_format/streams/frame.h"
#include "pbm_format/streams/sibling_layout.h"
#include "system/threads/per_thread.h"

#include <cassert>

namespace pbm {

namespace {

// The inverse of the zigzag of BVG.md 5.8.
std::uint32_t difference(std::uint32_t code) { return (code & 1) != 0 ? ~(code >> 1) : code >> 1; }

struct PlaneMemory {
    std::array<Bytes, 2> planes;
};

} // namespace

// A point is its node's value plus the difference in its code; only children have no code.
void unfilter_field(std::span<const ByteView> planes, std::uint8_t bytes, ByteView masks, ByteView parents,
                    std::span<std::uint8_t> to) {
    std::size_t point = 0, code = 0;
    for (std::size_t node = 0; node < masks.size(); ++node) {
        const std::uint32_t parent = stored_value(parents, node, bytes);
        const unsigned children = kChildren[masks[node]];
        if (children == 1) {
            set_stored_value(to, point++, bytes, parent);
            continue;
        }
        for (unsigned child = 0; child < children; ++child, ++code) {
            const std::uint32_t high = bytes == 2 ? planes[1][code] : 0U;
            set_stored_value(to, point++, bytes, parent + difference(planes[0][code] | high << 8));
        }
    }
}

Status decode_field(const FieldEntry &entry, const Field &field, ByteView stored, ByteView masks, ByteView parents,
                    Bytes &to, Wording wording) {
    assert(parents.size() == masks.size() * field.bytes);
    if (const std::uint64_t hash = hash64(stored); hash != entry.hash)
        return broken(wording, "17.5.1", entry.offset, "a field of the chunk was changed: its hash does not match",
                      hash_value(entry.hash), hash_value(hash));
    const MaskSummary summary = summarise_masks(masks);
    to.resize(static_cast<std::size_t>(summary.children) * field.bytes);
    if (entry.stream.filter == Filter::none)
        return decode_frame(stored, entry.stream.zstd, to, entry.offset, wording);
    const auto codes = static_cast<std::size_t>(summary.children - summary.only_children);
    PlaneCursor cursor(stored, field.bytes);
    std::array<ByteView, 2> planes;
    PlaneMemory &memory = per_thread<PlaneMemory>();
    for (std::size_t i = 0; i < field.bytes; ++i) {
        ByteView plane;
        bool zstd = false;
        if (!cursor.next(codes, plane, zstd))
            return impossible_planes(entry.offset, wording);
        memory.planes[i].resize(codes);
        if (Status status = decode_frame(plane, zstd, memory.planes[i], entry.offset, wording); !status)
            return status;
        planes[i] = memory.planes[i];
    }
    if (!cursor.finished())
        return impossible_planes(entry.offset, wording);
    unfilter_field(planes, field.bytes, masks, parents, to);
    return {};
}

} // namespace pbm
