#include "pbm_render/bricks/chunk_offsets.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace pbm {

namespace {

// A stored offset, -Offsets::kMost to Offsets::kMost, as SurfaceOffsets writes it.
std::int8_t step_of(int stored) {
    const int half = static_cast<int>(static_cast<float>(std::abs(stored)) / Offsets::kSteps * kOffsetSteps / 2 + 0.5F);
    const int even = 2 * std::min(half, 63);
    return static_cast<std::int8_t>(stored < 0 ? -even : even);
}

} // namespace

void ChunkOffsets::set_stored(const Offsets &stored, const ChunkView &chunk) {
    stored_.assign(chunk.normals.size(), kEstimated);
    for (std::size_t i = 0; i < stored.size(); ++i)
        if (chunk.normals[stored.points[i]] <= kNormalIndexMask)
            stored_[stored.points[i]] = step_of(stored.values[i]);
}

// A point stays redundant if the surface lies as deep as SurfaceOffsets asks for.
void ChunkOffsets::take_stored(std::size_t first_point, std::size_t count, BrickOffsets &to) const {
    constexpr auto kRedundant = static_cast<std::int8_t>(-kRedundantDepth * kOffsetSteps);
    const std::int8_t *const stored = stored_.data() + first_point;
    for (std::size_t i = 0; i < count; ++i) {
        const auto mark = static_cast<std::int8_t>(stored[i] <= kRedundant ? to.steps[i] & kRedundantBit : 0);
        to.steps[i] = stored[i] == kEstimated ? to.steps[i] : static_cast<std::int8_t>(stored[i] | mark);
    }
}

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
    const std::size_t before = surface_.points_before(brick), count = surface_.points_before(brick + 1) - before;
    if (!stored_.empty())
        take_stored(before, count, memory);
    // Of several threads that estimate the brick at once, one keeps the offsets.
    if (auto expected = kUnknown; starts_[brick].compare_exchange_strong(expected, kEstimating)) {
        const std::size_t start = before + brick * kPadding;
        std::copy_n(memory.steps.begin(), count, offsets_.data() + start);
        starts_[brick].store(static_cast<std::uint32_t>(start), std::memory_order_release);
    }
    return memory.steps.data();
}

} // namespace pbm
