// Points that face away from the eye, collected while the fronts of a strip are drawn: once these are there, most backs
// are hidden.
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/splats/facing_point_arrays.h"

#include <memory>
#include <span>
#include <vector>

namespace pbm {

class WaitingBacks {
  public:
    // Points of runs of one detail level: the size of their voxels is all that drawing takes of the run.
    struct Group {
        const RunGeometry *run; // any one of that level
        int block;              // VisibleBrick::block
        FacingPoints points;
    };

    // Removes all groups, and keeps their memory.
    void clear() {
        used_ = 0;
        open_.clear();
    }
    // A group for points of the run. It has room for a brick: fewer than kWaiting points are in it.
    Group &group_of(const RunGeometry &run, int block);
    std::span<const std::unique_ptr<Group>> groups() const { return std::span(groups_).first(used_); }

  private:
    Group &add(const RunGeometry &run, int block);

    std::size_t used_ = 0;
    std::vector<std::unique_ptr<Group>> groups_;
    std::vector<Group *> open_; // one of each level and kind
};

} // namespace pbm
