// Where in its voxels the surface lies at the points of one chunk, for as long as the chunk is at hand.
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/bricks/surface_offsets.h"

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace pbm {

// Estimated when a picture needs them, and no memory before: a first picture for the bricks that it shows, whatever
// shows others for all others.
class ChunkOffsets {
  public:
    // [points] as SurfaceOffsets::estimate has it, good for the points of the bricks `seen`; those of others may be
    // written while they are read. `chunk` is always the same. Several threads may ask at once: they wait for each
    // other.
    const std::int8_t *of(const ChunkView &chunk, std::span<const SeenBrick> seen, SurfaceOffsets &workplace) const;

  private:
    mutable std::mutex mutex_;                 // of all below
    mutable std::vector<std::int8_t> offsets_; // [points] once some are known
    mutable std::vector<std::uint8_t> known_;  // [bricks] the same
    mutable bool is_first_ = true, is_complete_ = false;
};

} // namespace pbm
