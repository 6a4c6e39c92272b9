// What a picture is made of: runs of points of chunks, each at the detail level its place on the screen asks for.
// Together they show every place of the model once: a run leaves out what finer chunks show instead.
#pragma once

#include "pbm_format/mapped_chunk.h"

#include <cstdint>

namespace pbm {

struct PointRun {
    const ChunkView *chunk = nullptr;  // its streams, decoded or where they lie in a mapped file
    const ChunkEntry *entry = nullptr; // its place in the octree and its normal cone
    int level = 1;                     // of the points, 1..depth
    // The points first..last - 1 of the chunk, which are whole nodes of level `level` - 1.
    std::uint32_t first = 0, last = 0;
};

} // namespace pbm
