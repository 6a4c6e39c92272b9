// The encoder of chunks; chunk.h undoes it. BVG.md sections 5 and 6
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/model/streams.h"

namespace pbm {

// The unfiltered bytes of one stream of a chunk. BVG.md 5.4
Bytes raw_stream(const StreamContext &context, ByteView masks, const PointView &points);

struct ChunkCoding {
    Storage storage = Storage::packed; // mapped streams are raw and aligned (5.10); the rest is for packed ones
    int compression_level = 1;         // 1..19, see frame_encoder.h
    bool filters = true;               // try them
};

// Codes the streams of one chunk, whose shape and places in `model` stand in `entry`. Deterministic for a zstd version.
// Fills the rest of `entry` and appends the stored bytes to `out`.
void encode_chunk(const Model &model, int level, const ChunkCoding &coding, ChunkEntry &entry, Bytes &out);

} // namespace pbm
