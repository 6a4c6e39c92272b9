// One chunk between memory and file: streams, zstd, hash. BVG.md sections 5 and 6. The only user of zstd.
#pragma once

#include "pbm_format/layout.h"

namespace pbm {

// A subtree of one level, decoded and proven.
struct Chunk {
    Bytes masks; // one per node of the level above
    PointAttributes points;
};

// Compresses the streams of one chunk. Deterministic for a zstd version and `compression_level` (1..19).
// Fills shape, cone, hash, streams and stored_bytes of `entry` and appends the stored bytes to `out`.
void encode_chunk(const Level &level, int level_index, const ChunkShape &shape, std::uint64_t first_node,
                  std::uint64_t first_point, const AttributeSet &set, int compression_level, ChunkEntry &entry,
                  Bytes &out);

// Decodes the chunk whose stored bytes are `stored` and proves it before anyone uses it: hash, frames, masks, counts,
// ranges of every attribute, normal cone. Allocates what `entry` promises, which decode_directory has bounded.
// `material_count` bounds material indices, `finest` says that the radii are those of the finest level (6.2.2).
// Error offsets are file offsets.
//
// errors  bad_hash (5.6.4), bad_octree (4.2, 4.4), bad_attribute (5.6 frames, 5.7 cone, section 6 values)
Result<Chunk> decode_chunk(const ChunkEntry &entry, ByteView stored, int level, const AttributeSet &set,
                           std::size_t material_count, bool finest);

// Copies a decoded chunk to its place in a level whose streams have their full size.
void place_chunk(const Chunk &chunk, const ChunkEntry &entry, const AttributeSet &set, Level &level);

// Narrowest cone around the mean of `normals` that holds them all.
NormalCone bound_normals(std::span<const std::uint16_t> normals);

} // namespace pbm
