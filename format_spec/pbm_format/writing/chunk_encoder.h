// Encodes chunks; chunk.h decodes them. BVG.md 5 and 6
#pragma once

#include "pbm_format/container/field_sections.h"
#include "pbm_format/container/point_streams.h"
#include "pbm_format/model/model.h"

namespace pbm {

// The unfiltered bytes of one stream of a chunk. BVG.md 5.4
Bytes raw_stream(const StreamContext &context, ByteView masks, const PointView &points);

// The entries of the chunks of a level in their order: shapes, and the first parent, node and point of each.
std::vector<ChunkEntry> place_chunks(std::span<const ChunkShape> shapes);

struct ChunkCoding {
    Storage storage = Storage::packed; // mapped streams are raw and aligned (5.10), packed ones as below
    int compression_level = 1;         // 1..19, see frame_encoder.h
    bool filters = true;               // try filters
};

// Encodes the streams of one chunk, whose shape and place in `model` are in `entry`. Fills the rest of `entry` and
// appends the stored bytes to `out`. Deterministic for one version of zstd.
void encode_chunk(const Model &model, int level, const ChunkCoding &coding, ChunkEntry &entry, Bytes &out);

// Appends the values of one field in the chunk `chunk`, which has been encoded. BVG.md 17.5
FieldEntry encode_field(const Model &model, int level, std::size_t field, const ChunkEntry &chunk,
                        const ChunkCoding &coding, Bytes &out);

// Appends what a kind of point stream says of the points of `chunk`, which has been encoded. A chunk with sides loses
// its normal cone. BVG.md 19
PointStreamEntry encode_point_stream(const Model &model, int level, PointStream kind, const ChunkCoding &coding,
                                     ChunkEntry &chunk, Bytes &out);

} // namespace pbm
