// The points of one detail level in Morton order, chunk by chunk: what a file of any size needs of memory is bounded.
#pragma once

#include "pbm_format/reading/reader.h"

#include <functional>
#include <span>

namespace pbm {

// Points that lie in one chunk.
struct PointBlock {
    std::span<const MortonCode> codes; // of the level's nodes, ascending
    const PointAttributes &points;     // as many
};

struct StreamOptions {
    int level = kMaxDepth; // 0..depth
    int threads = 0;
    std::uint64_t max_memory = kDefaultMaxMemory; // bytes
};

// What becomes of the points.
struct PointSink {
    std::size_t row_bytes;                           // of a point, at most
    std::function<Bytes(const PointBlock &)> encode; // called on any thread
    std::function<Status(ByteView)> write;           // called in order, on the calling thread
    std::function<void(double)> progress = {};       // with 0..1 between blocks; may be empty
};

// Decodes the chunks of `level`, and of the levels above for their masks, each once, verified before use.
//
// errors  memory  one block at a time needs more than max_memory
//         those of the reader and of `write`: nothing more is written then
Status stream_points(Reader &reader, const StreamOptions &options, const PointSink &sink);

} // namespace pbm
