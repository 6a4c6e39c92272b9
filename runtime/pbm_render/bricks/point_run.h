// A run of points of one chunk. The runs of a picture, each at the detail level that its distance needs, show every
// place of the model once: a run leaves out what finer chunks show.
// Stability: experimental.
#pragma once

#include "pbm_format/chunks/chunk.h"

#include <cstddef>
#include <cstdint>

namespace pbm {

class ChunkOffsets;

struct PointRun {
    const ChunkView *chunk = nullptr;  // its streams: decoded, or in the mapped file
    const ChunkEntry *entry = nullptr; // its place in the octree and its normal cone
    int level = 1;                     // of the points, 1..depth
    // The points first..last - 1 of the chunk, which are whole nodes of level `level` - 1.
    std::uint32_t first = 0, last = 0;
    const ChunkOffsets *offsets = nullptr; // of its points; null: splats lie at the mean surface
    // Of second sides (chunk_sides.h): whose points, of the chunk in the file, they are. Null: the points are the
    // chunk's.
    const std::uint32_t *origins = nullptr;
    bool has_sides = false;    // some points are sides: normals with kSideBit
    bool hides_points = false; // some are hidden: normals with kHiddenBits
};

// Value of point `i` in a shadow stream of `bits` bits, 0 .. 2^bits - 1; the largest is fully lit.
inline unsigned shadow_value(const std::uint8_t *stream, std::size_t i, unsigned bits) {
    const std::size_t at = i * bits;
    return stream[at / 8] >> (at % 8) & ((1U << bits) - 1);
}

} // namespace pbm
