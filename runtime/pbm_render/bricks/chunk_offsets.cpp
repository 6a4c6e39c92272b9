#include "pbm_render/bricks/chunk_offsets.h"

#include <algorithm>

namespace pbm {

void ChunkOffsets::begin(const ChunkView &chunk) const {
    const std::lock_guard lock(mutex_);
    if (has_begun_)
        return;
    surface_.begin(chunk);
    offsets_.resize(chunk.normals.size());
    known_ = std::vector<std::atomic<Known>>(chunk.bricks.size());
    has_begun_ = true;
}

void ChunkOffsets::read(const ChunkView &chunk, std::uint32_t brick, BrickOffsets &to) const {
    std::atomic<Known> &known = known_[brick];
    const std::size_t before = surface_.points_before(brick), points = surface_.points_before(brick + 1) - before;
    std::int8_t *const kept = offsets_.data() + before;
    if (known.load(std::memory_order_acquire) == Known::yes) {
        std::copy_n(kept, points, to.steps.begin());
        return;
    }
    surface_.estimate(chunk, brick, to);
    // Of several threads that estimate the brick at once, one keeps the offsets.
    if (auto expected = Known::no; known.compare_exchange_strong(expected, Known::soon)) {
        std::copy_n(to.steps.begin(), points, kept);
        known.store(Known::yes, std::memory_order_release);
    }
}

void ChunkOffsets::estimate(const ChunkView &chunk, std::span<const SeenBrick> seen) const {
    begin(chunk);
    BrickOffsets kept;
    for (const SeenBrick &it : seen)
        if (it.faces_eye && known_[it.brick].load(std::memory_order_relaxed) == Known::no)
            read(chunk, it.brick, kept);
}

} // namespace pbm
