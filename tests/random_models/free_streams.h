// Encodes streams and raster tiles in any form that BVG.md 5.4 to 5.8 and 3.10 allow.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/model/streams.h"
#include "pbm_format/rasters/image_section.h"
#include "unit/support/test_models.h"

namespace pbm::test {

// Appends one stream, raw, as a frame or filtered.
StreamEntry append_freely(const StreamContext &context, ByteView masks, const PointView &points,
                          const ChunkNodes &nodes, Random &random, Bytes &out);

// The same of bytes without a filter, as they are or, unless `as_they_are`, perhaps as a frame.
StreamEntry append_raw_freely(const Bytes &raw, bool as_they_are, Random &random, Bytes &out);

// The same of a field's values in a chunk, whose nodes have the values `parents`.
StreamEntry append_field_freely(const Field &field, ByteView masks, ByteView points, ByteView parents, Random &random,
                                Bytes &out);

// A random cone that contains the normals, or none.
NormalCone random_cone(std::span<const std::uint16_t> normals, Random &random);

// The section of a raster of a packed file, each tile raw, as a frame or filtered.
Bytes encode_image_freely(const Image &image, Random &random);

} // namespace pbm::test
