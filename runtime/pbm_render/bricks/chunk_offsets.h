// The surface offsets of one chunk's points; they live as long as the chunk is resident.
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_surface/surface_offsets.h"

#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace pbm {

// Estimates offsets brick by brick, when a picture needs them, and keeps them.
class ChunkOffsets {
  public:
    // Estimates the offsets of the bricks in `seen` that face the eye, one after the other as they lie in memory. Of
    // the others most are hidden behind nearer points; `read` estimates those that are not. Call this before `read`,
    // with the same chunk. Several threads may call both at once.
    void estimate(const ChunkView &chunk, std::span<const SeenBrick> seen) const;
    // Writes the offsets of a brick's points, as SurfaceOffsets::estimate.
    void read(const ChunkView &chunk, std::uint32_t brick, BrickOffsets &to) const;

    // Bytes that they take at most, for a chunk of this shape.
    static std::uint64_t memory_of(const ChunkShape &shape) {
        return shape.points + shape.bricks + SurfaceOffsets::memory_of(shape);
    }

  private:
    enum class Known : std::uint8_t { no, soon, yes };

    void begin(const ChunkView &chunk) const;

    mutable std::mutex mutex_; // of `begin`
    mutable bool has_begun_ = false;
    mutable SurfaceOffsets surface_;
    mutable std::vector<std::int8_t> offsets_;      // [points]
    mutable std::vector<std::atomic<Known>> known_; // [bricks]: whether offsets_ holds those of the brick
};

} // namespace pbm
