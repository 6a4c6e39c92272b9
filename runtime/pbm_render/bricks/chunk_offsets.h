// The surface offsets of one chunk's points; they live as long as the chunk is resident.
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/picture/framebuffer.h"
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
    // The offsets of the file, which take the place of estimates: BVG.md 19.6. Those of points that are two-sided,
    // round or hidden or have sides, as the normals of the chunk say, mean nothing. Call this before everything else.
    void set_stored(const Offsets &stored, const ChunkView &chunk);
    // Estimates the offsets of the bricks in `seen` that face the eye, in their order in memory. Most other bricks are
    // hidden behind nearer points; `read` estimates the offsets of those that are not. Call this before `read`, with
    // the same chunk. Several threads may call both at once.
    void estimate(const ChunkView &chunk, std::span<const VisibleBrick> seen) const;
    // Whether the offsets of a brick are kept. Must not run beside the first call of `estimate`.
    bool has(std::uint32_t brick) const {
        return brick < starts_.size() && starts_[brick].load(std::memory_order_relaxed) < kEstimating;
    }
    // Returns the offsets of a brick's points, as SurfaceOffsets::estimate writes them, padded. Offsets that are not
    // kept are estimated into `memory`.
    const std::int8_t *read(const ChunkView &chunk, std::uint32_t brick, BrickOffsets &memory) const {
        const std::uint32_t start = starts_[brick].load(std::memory_order_acquire);
        return start < kEstimating ? offsets_.data() + start : estimate(chunk, brick, memory);
    }

    // Upper bound of the memory that the offsets of a chunk of this shape take, bytes. `has_stored`: the file has some.
    static std::uint64_t memory_of(const ChunkShape &shape, bool has_stored = false) {
        return (has_stored ? 2 : 1) * std::uint64_t{shape.points} + shape.bricks * (kPadding + sizeof(std::uint32_t)) +
               SurfaceOffsets::memory_of(shape);
    }

  private:
    // Bytes between the offsets of two bricks: SIMD loads may read so many beyond the last offset of a brick.
    static constexpr std::size_t kPadding = 16;
    // Values in starts_ of bricks whose offsets are not kept: a thread estimates them, or none does.
    static constexpr std::uint32_t kEstimating = 0xFFFFFFFE, kUnknown = 0xFFFFFFFF;

    // Where the file has no offset.
    static constexpr std::int8_t kEstimated = -128;

    void begin(const ChunkView &chunk) const;
    void take_stored(std::size_t first_point, std::size_t count, BrickOffsets &to) const;
    const std::int8_t *estimate(const ChunkView &chunk, std::uint32_t brick, BrickOffsets &memory) const;

    std::vector<std::int8_t> stored_; // [points] as SurfaceOffsets writes them, or kEstimated; empty: none
    mutable std::mutex mutex_;        // of `begin`
    mutable bool has_begun_ = false;
    mutable SurfaceOffsets surface_;
    // Of the bricks, each padded. Those of bricks that no picture shows stay uninitialized, and their pages untouched.
    mutable std::vector<std::int8_t, UninitializedAllocator<std::int8_t>> offsets_;
    mutable std::vector<std::atomic<std::uint32_t>> starts_; // [bricks]: index of its first offset
};

} // namespace pbm
