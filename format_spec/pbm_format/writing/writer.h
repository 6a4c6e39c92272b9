// Writing .pbvg files. BVG.md sections 2 to 8.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/model/model.h"

#include <functional>
#include <string>

namespace pbm {

inline constexpr int kDefaultCompressionLevel = 3; // of 1..19, see frame_encoder.h

struct WriteOptions {
    Storage storage = Storage::packed; // mapped: compression_level and filters do not matter
    int compression_level = kDefaultCompressionLevel;
    bool filters = true; // store streams as differences to the level above where smaller
    std::uint32_t chunk_points = kDefaultChunkPoints;
    int threads = 0;
    std::function<void(double)> progress{}; // 0..1, from any of the threads
};

// The file as bytes: the same for any thread count. The model must be complete (average_levels done);
// broken parameters are refused as the reader would refuse them.
Result<Bytes> encode_model(const Model &model, const WriteOptions &options = {});

// encode_model, then verify what came out, then replace `path` atomically. Returns the file's size.
Result<std::uint64_t> write_model(const std::string &path, const Model &model, const WriteOptions &options = {});

} // namespace pbm
