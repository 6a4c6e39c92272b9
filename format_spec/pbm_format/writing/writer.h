// Encodes and writes .pbvg files. BVG.md 2 to 8
// Stability: stable.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/model/model.h"

#include <functional>
#include <string>

namespace pbm {

inline constexpr int kDefaultCompressionLevel = 3; // of 1..19, see frame_encoder.h

struct WriteOptions {
    Storage storage = Storage::packed; // mapped: ignores compression_level and filters
    int compression_level = kDefaultCompressionLevel;
    bool filters = true; // store streams as differences to the level above if that is smaller
    std::uint32_t chunk_points = kDefaultChunkPoints;
    int threads = 0;
    std::function<void(double)> progress{}; // receives 0..1, on any of the threads
};

// Returns the file's bytes, the same for any thread count. The model must be complete (average_levels done). Parameters
// that the reader would refuse are errors.
Result<Bytes> encode_model(const Model &model, const WriteOptions &options = {});

// Encodes the model, verifies the result, then replaces `path` atomically. Returns the file's size.
Result<std::uint64_t> write_model(const std::string &path, const Model &model, const WriteOptions &options = {});

} // namespace pbm
