// A run of points of one chunk. The runs of a picture, each at the detail level that its distance needs, show every
// place of the model once: a run leaves out what finer chunks show.
#pragma once

#include "pbm_format/chunks/mapped_chunk.h"

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
};

// Lit fraction of point `i` of the run's chunk, 0..1. The light has a shadow stream of `bits` bits at the run's level.
inline float lit_fraction(const PointRun &run, std::size_t i, std::size_t light, unsigned bits) {
    const std::size_t at = i * bits;
    const unsigned most = (1U << bits) - 1;
    return static_cast<float>(run.chunk->shadows[light][at / 8] >> (at % 8) & most) / static_cast<float>(most);
}

} // namespace pbm
