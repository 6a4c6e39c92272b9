// Whole models in memory, for tools and tests. Viewers read chunk by chunk instead (pbm_render/detail).
// Stability: stable.
#pragma once

#include "pbm_format/reading/reader.h"

#include <functional>

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

// The same without sides and fields, which a position of a camera does not depend on.
Result<Model> load_levels(Reader &reader, const LoadOptions &options = {}, std::uint64_t other_bytes = 0);

// Decodes the chunks of a level, whose directory was read before, and calls `visit` with the index and the contents of
// each, from any thread. `above` has the masks and points of the level above, as a whole. `left_out`: as in ChunkRules;
// a mapped file has all of them. Ends with an error of the first chunk that has one.
Status for_chunks(const Reader &reader, const LevelDirectory &directory, const Level &above, int threads,
                  unsigned left_out, const std::function<Status(std::size_t index, const Chunk &chunk)> &visit);

// The same as load_points with all rasters.
Result<Model> load_model(Reader &reader, const LoadOptions &options = {});

} // namespace pbm
