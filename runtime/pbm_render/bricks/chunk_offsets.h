// The surface offsets of one chunk's points; they live as long as the chunk is resident.
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_surface/surface_offsets.h"

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace pbm {

// Computes the offsets lazily and allocates no memory before. The first frame that shows the chunk estimates them for
// the visible bricks; the first frame that shows another brick estimates them for all others.
class ChunkOffsets {
  public:
    // Returns the offsets of the chunk's points, as SurfaceOffsets::estimate writes them. They are valid for the bricks
    // in `seen`; another thread may still write those of other bricks. All calls must pass the same chunk. Several
    // threads may call at once and wait for each other.
    const std::int8_t *of(const ChunkView &chunk, std::span<const SeenBrick> seen, SurfaceOffsets &workplace) const;

  private:
    mutable std::mutex mutex_;                 // guards all below
    mutable std::vector<std::int8_t> offsets_; // [points]; empty before the first estimate
    mutable std::vector<std::uint8_t> known_;  // [bricks]: nonzero where the offsets are estimated
    mutable bool is_first_ = true, is_complete_ = false;
};

} // namespace pbm
