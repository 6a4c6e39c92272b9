// Streams the points of one detail level in Morton order, chunk by chunk, with bounded memory for files of any size.
#pragma once

#include "pbm_format/reading/field_reader.h"
#include "pbm_format/reading/point_stream_reader.h"
#include "pbm_format/reading/reader.h"

#include <functional>
#include <span>

namespace pbm {

struct PointBlock {
    std::span<const MortonCode> codes; // Morton codes of the points, ascending; both sides of a wall have the same
    const PointAttributes &points;     // [codes.size()]
    std::span<const Bytes> fields;     // [fields of the file]: stored values
};

struct StreamOptions {
    int level = kMaxDepth; // 0..depth
    int threads = 0;
    std::uint64_t max_memory = kDefaultMaxMemory; // bytes
};

// Destination of the points.
struct PointSink {
    std::size_t row_bytes;                           // upper bound per point
    std::function<Bytes(const PointBlock &)> encode; // called on any thread
    std::function<Status(ByteView)> write;           // called in order, on the calling thread
    std::function<void(double)> progress = {};       // receives 0..1 between blocks; may be empty
};

// Decodes each chunk of `level` once, and those of the levels above for their masks; verifies each before use. A point
// with sides (BVG.md 19.4) is two points, one after the other.
//
// errors  memory  a single block needs more than max_memory
//         those of the reader and of `write`, after which nothing more is written
Status stream_points(Reader &reader, const StreamOptions &options, const PointSink &sink);

} // namespace pbm
