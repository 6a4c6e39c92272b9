// One chunk, decoded or where it lies in a mapped file, and its decoder: streams, filters, frames, hash. BVG.md 5 and 6
// Stability: experimental.
#pragma once

#include "pbm_format/container/layout.h"
#include "system/byte_source.h"

#include <array>
#include <memory>
#include <span>

namespace pbm {

struct ChunkRules; // stream_rules.h

// A subtree of one level, decoded and verified. Pass the same object again to reuse its memory.
struct Chunk {
    Bytes masks; // one per node: of level L - 1
    PointAttributes points;
    // Lit fractions as packed in a file (BVG.md 6.6). decode_chunk fills them if the caller has set `packs_shadows`. It
    // then leaves points.shadows of the finest level empty, since no chunk below needs them.
    std::array<Bytes, kMaxLights> packed_shadows{};
    bool packs_shadows = false;
};

// Streams and bricks of a chunk of a mapped file, where they lie. Lit fractions are packed, lowest bits first:
// BVG.md 6.6
struct ChunkView : PointView {
    ByteView masks;
    std::span<const BrickRecord> bricks;
    std::array<std::shared_ptr<const void>, 2> owners; // keep the bytes readable; null if the file does
};

// The bytes of a chunk; the bricks are those of a mapped file.
struct ChunkBytes {
    HeldBytes streams, bricks;
};

// The streams of a chunk in the file.
inline FileRange chunk_range(const ChunkEntry &entry) { return {entry.offset, entry.stored_bytes}; }

// The nodes of the chunk `entry` of level L, out of the masks and points of level L - 1. `first_mask` and `first_point`
// are the indices, in that level, of the first mask and point given: 0 for a whole level, else those of the parent
// chunk.
ChunkNodes chunk_nodes(const ChunkEntry &entry, ByteView masks, std::uint64_t first_mask, const PointAttributes &points,
                       std::uint64_t first_point, const AttributeSet &set);

// Decodes the chunk with the stored bytes `stored` and verifies it: hash, frames, masks, counts, ranges of every
// attribute, normal cone. Allocates the sizes in `entry`, which decode_directory has bounded. `nodes` must be decoded
// and verified. Error offsets are file offsets. After an error the contents of `to` are undefined, as are always those
// of streams that `rules` leave out.
//
// errors  bad_hash (5.6.4), bad_octree (4.2, 4.4), bad_attribute (5.6 frames, 5.7 cone, 5.8 filters, section 6 values)
Status decode_chunk(const ChunkEntry &entry, ByteView stored, const ChunkRules &rules, const ChunkNodes &nodes,
                    Chunk &to);

// Copies a decoded chunk to its place in a level whose streams have their full size.
void place_chunk(const Chunk &chunk, const ChunkEntry &entry, const AttributeSet &set, Level &level);

} // namespace pbm
