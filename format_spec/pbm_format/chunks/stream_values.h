// What the values of all kinds of point streams have in common: a hash, a frame, and at their start a mask of the
// points of the chunk that they say something of. BVG.md 19.3
#pragma once

#include "pbm_format/container/point_streams.h"
#include "pbm_format/law/catalogue.h"

namespace pbm {

inline std::uint64_t mask_bytes(std::uint64_t points) { return (points + 7) / 8; }

// The part of a list of points that belongs to a chunk.
struct PointsOfChunk {
    std::size_t first = 0, count = 0;
};
// `points`: indices within the level, ascending.
PointsOfChunk points_of(std::span<const std::uint32_t> points, const ChunkEntry &entry);

// The mask of these points, which belong to the chunk.
Bytes encode_mask(std::span<const std::uint32_t> points, const ChunkEntry &entry);

// Lists the points that the mask at the start of `raw` marks, as indices within the chunk. False: there is no whole
// mask, or it marks no point, or one that the chunk does not have.
bool read_mask(ByteView raw, std::uint32_t chunk_points, std::vector<std::uint32_t> &to);

// The raw bytes of the stream of a chunk. Error offsets are file offsets.
//
// errors  bad_hash (19.3.1), bad_attribute (5.6 frames)
Result<Bytes> decode_stream_values(const PointStreamEntry &entry, ByteView stored, PointStream kind, Wording wording);

} // namespace pbm
