// Filters streams; unfilter.h inverts that. BVG.md 5.8
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_format/model/streams.h"

#include <optional>
#include <vector>

namespace pbm {

// Planes of the stream of `points` with filter_of(stream). Empty if the filter cannot represent it: an only child
// differs from its parent. `masks` are the chunk's, one per node.
std::optional<std::vector<Bytes>> filter_stream(const StreamContext &context, ByteView masks, const PointView &points,
                                                const ChunkNodes &nodes);

// Planes of a field's stored values in a chunk, whose nodes have the values `parents`. BVG.md 17.5
std::optional<std::vector<Bytes>> filter_field(const Field &field, ByteView masks, ByteView points, ByteView parents);

} // namespace pbm
