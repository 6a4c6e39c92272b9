// Encodes chunks; chunk.h decodes them. BVG.md 5 and 6
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/model/streams.h"

namespace pbm {

// The unfiltered bytes of one stream of a chunk. BVG.md 5.4
Bytes raw_stream(const StreamContext &context, ByteView masks, const PointView &points);

struct ChunkCoding {
    Storage storage = Storage::packed; // mapped streams are raw and aligned (5.10), packed ones as below
    int compression_level = 1;         // 1..19, see frame_encoder.h
    bool filters = true;               // try filters
};

// Encodes the streams of one chunk, whose shape and place in `model` are in `entry`. Fills the rest of `entry` and
// appends the stored bytes to `out`. Deterministic for one version of zstd.
void encode_chunk(const Model &model, int level, const ChunkCoding &coding, ChunkEntry &entry, Bytes &out);

} // namespace pbm
