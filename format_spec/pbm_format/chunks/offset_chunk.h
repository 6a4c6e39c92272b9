// Encodes and decodes the surface offsets of one chunk. BVG.md 19.6
//
//   mask      one bit for each point of the chunk: it has an offset
//   offsets   of each point that has one, a signed byte
#pragma once

#include "pbm_format/chunks/stream_values.h"

namespace pbm {

// The raw bytes of the offsets of the chunk `entry`, whose points are those of a level; empty if it has none.
Bytes encode_offsets(const Offsets &offsets, const ChunkEntry &entry);

// Decodes the offsets of a chunk of so many points, with indices within the chunk, from the bytes of `entry`. Error
// offsets are file offsets. After an error the contents of `to` are undefined.
//
// errors  bad_hash (19.3.1), bad_attribute (5.6 frames, 19.6)
Status decode_offsets(const PointStreamEntry &entry, ByteView stored, std::uint32_t chunk_points, Wording wording,
                      Offsets &to);

} // namespace pbm
