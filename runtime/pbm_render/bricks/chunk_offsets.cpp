#include "pbm_render/bricks/chunk_offsets.h"

#include <algorithm>

namespace pbm {

void ChunkOffsets::begin(const ChunkView &chunk) const {
    const std::lock_guard lock(mutex_);
    if (has_begun_)
        return;
    surface_.begin(chunk);
    // The bytes of a mapped chunk may change, and its bricks get more points: they stay in bounds.
    offsets_.resize(chunk.normals.size() + chunk.bricks.size() * kPadding + sizeof(BrickOffsets::steps));
    starts_ = std::vector<std::atomic<std::uint32_t>>(chunk.bricks.size());
    for (std::atomic<std::uint32_t> &start : starts_)
        start.store(kUnknown, std::memory_order_relaxed);
    has_begun_ = true;
}

void ChunkOffsets::estimate(const ChunkView &chunk, std::span<const VisibleBrick> seen) const {
    begin(chunk);
    BrickOffsets memory;
    for (const VisibleBrick &it : seen)
        if (it.faces_eye && starts_[it.brick].load(std::memory_order_relaxed) == kUnknown)
            estimate(chunk, it.brick, memory);
}

const std::int8_t *ChunkOffsets::estimate(const ChunkView &chunk, std::uint32_t brick, BrickOffsets &memory) const {
    memory.steps.fill(0);
    surface_.estimate(chunk, brick, memory);
    // Of several threads that estimate the brick at once, one keeps the offsets.
    if (auto expected = kUnknown; starts_[brick].compare_exchange_strong(expected, kEstimating)) {
        const std::size_t before = surface_.points_before(brick), start = before + brick * kPadding;
        std::copy_n(memory.steps.begin(), surface_.points_before(brick + 1) - before, offsets_.data() + start);
        starts_[brick].store(static_cast<std::uint32_t>(start), std::memory_order_release);
    }
    return memory.steps.data();
}

} // namespace pbm
