// Encodes and decodes the point streams of one chunk. BVG.md 19.3 to 19.6
//
//   mask      one bit for each point of the chunk: the stream says something of it
//
// then, of sides (19.4):
//
//   normals   of both sides of each point that has them, 2 bytes each
//   colours, materials, texture values, lit fractions 0, 1, ...   the same, as in a chunk's streams
//
// and of surface offsets (19.6):
//
//   offsets   of each point that has one, a signed byte
#pragma once

#include "pbm_format/chunks/stream_rules.h"
#include "pbm_format/container/point_streams.h"

namespace pbm {

// The streams of sides, in order: those of a chunk but for masks and radii.
StreamList side_streams(const AttributeSet &set);

// The raw bytes of the sides of the chunk `entry`, whose points are those of a level; empty if it has none.
Bytes encode_sides(const Sides &sides, const ChunkEntry &entry, const AttributeSet &set, int level);

// Decodes the sides of a chunk, with indices within the chunk, from the bytes of `entry`. Error offsets are
// file offsets. After an error the contents of `to` are undefined.
//
// errors  bad_hash (19.3.1), bad_attribute (5.6 frames, 6.4.1, 6.6.1, 19.4)
Status decode_sides(const PointStreamEntry &entry, ByteView stored, const ChunkEntry &chunk, const ChunkRules &rules,
                    Sides &to);

// The raw bytes of the offsets of the chunk `entry`, whose points are those of a level; empty if it has none.
Bytes encode_offsets(const Offsets &offsets, const ChunkEntry &entry);

// Decodes the offsets of a chunk of so many points, with indices within the chunk, from the bytes of `entry`. Error
// offsets are file offsets. After an error the contents of `to` are undefined.
//
// errors  bad_hash (19.3.1), bad_attribute (5.6 frames, 19.6)
Status decode_offsets(const PointStreamEntry &entry, ByteView stored, std::uint32_t chunk_points, Wording wording,
                      Offsets &to);

} // namespace pbm
