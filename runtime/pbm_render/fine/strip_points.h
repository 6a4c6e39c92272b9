// The points of a strip, kept from its first pass to its second.
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/bricks/point_ids.h"
#include "pbm_render/fine/surface_points.h"
#include "pbm_render/splats/facing_point_arrays.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace pbm {

class StripPoints {
  public:
    // `are_backs`: FacingPoints::are_backs of all blocks.
    explicit StripPoints(bool are_backs) : are_backs_(are_backs) {}

    // Points of one run.
    struct Block {
        const RunGeometry *run;
        std::uint32_t first_id; // of the run's chunk
        FacingPoints points;
    };

    // Removes all blocks, and keeps their memory.
    void clear() { used_ = 0; }
    // Adds a block without points.
    Block &add(const RunGeometry &run, std::uint32_t first_id) {
        if (used_ == blocks_.size())
            blocks_.push_back(std::make_unique_for_overwrite<Block>());
        Block &block = *blocks_[used_++];
        block.run = &run;
        block.first_id = first_id;
        block.points.count = 0;
        block.points.near.clear();
        block.points.are_backs = are_backs_;
        return block;
    }
    std::span<const std::unique_ptr<Block>> blocks() const { return std::span(blocks_).first(used_); }
    // Whether no block has a point.
    bool empty() const {
        const auto is_empty = [](const auto &block) { return block->points.count == 0 && block->points.near.empty(); };
        return std::all_of(blocks().begin(), blocks().end(), is_empty);
    }

  private:
    bool are_backs_;
    std::size_t used_ = 0;
    std::vector<std::unique_ptr<Block>> blocks_;
};

// Reads all channels of point `i` of a block.
inline void read_point(const FrameGeometry &frame, const StripPoints::Block &block, std::size_t i,
                       const SurfacePoints &looks, SurfacePoint &to) {
    const FacingPoints &facing = block.points;
    const EyeNormal &n = frame.normals[static_cast<std::size_t>(facing.normal_index[i] & frame.normal_mask)];
    const float ray_x = (facing.x[i] - frame.middle_x) * frame.inverse_focal,
                ray_y = (facing.y[i] - frame.middle_y) * frame.inverse_focal;
    const bool turn =
        facing.are_backs || ((facing.normal[i] & kPackedTwoSided) != 0 && n.x * ray_x + n.y * ray_y + n.z > 0);
    const float sign = turn ? -1.0F : 1.0F;
    to.channels[channel::kNormal] = sign * n.x;
    to.channels[channel::kNormal + 1] = sign * n.y;
    to.channels[channel::kNormal + 2] = sign * n.z;
    to.channels[channel::kWeight] = 1;
    const std::uint32_t point = (static_cast<std::uint32_t>(facing.id[i]) & ~PointIds::kBackBit) - block.first_id;
    looks.read(*block.run->run, point, to);
}

} // namespace pbm
