// Whole models in memory, for tools and tests. Viewers read chunk by chunk instead (pbm_render/detail).
#pragma once

#include "pbm_format/reading/reader.h"

namespace pbm {

struct LoadOptions {
    int max_level = kMaxDepth; // levels 0..min(max_level, depth) are loaded
    int threads = 0;
    std::uint64_t max_memory = kDefaultMaxMemory; // bytes of decoded streams and rasters; more is ErrorCode::memory
    bool fields = false;                          // load the fields too; else the model has none
};

// All levels up to `max_level`, each as contiguous streams, without the rasters. `other_bytes` is memory that the
// caller takes from the same budget.
Result<Model> load_points(Reader &reader, const LoadOptions &options = {}, std::uint64_t other_bytes = 0);

// The same with all rasters.
Result<Model> load_model(Reader &reader, const LoadOptions &options = {});

} // namespace pbm
