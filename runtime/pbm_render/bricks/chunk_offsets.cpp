#include "pbm_render/bricks/chunk_offsets.h"

#include <utility>

namespace pbm {

const std::int8_t *ChunkOffsets::of(const ChunkView &chunk, std::span<const SeenBrick> seen,
                                    SurfaceOffsets &workplace) const {
    const std::lock_guard lock(mutex_);
    if (is_complete_)
        return offsets_.data();
    offsets_.resize(chunk.normals.size());
    known_.resize(chunk.bricks.size());
    std::vector<std::uint32_t> missing;
    for (const SeenBrick &brick : seen)
        if (known_[brick.brick] == 0)
            missing.push_back(brick.brick);
    if (missing.empty())
        return offsets_.data();
    if (!std::exchange(is_first_, false)) { // each estimate lists all bricks, its main cost: make at most two
        missing.clear();
        for (std::uint32_t i = 0; i < known_.size(); ++i)
            if (known_[i] == 0)
                missing.push_back(i);
        is_complete_ = true;
    }
    workplace.estimate(chunk, missing, offsets_);
    for (const std::uint32_t brick : missing)
        known_[brick] = 1;
    return offsets_.data();
}

} // namespace pbm
