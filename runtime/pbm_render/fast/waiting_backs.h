// Points that face away from the eye, collected while the fronts of a strip are drawn. Once the fronts are drawn, they
// hide most backs.
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/splats/facing_point_arrays.h"

#include <memory>
#include <span>
#include <vector>

namespace pbm {

class WaitingBacks {
  public:
    // Points of runs of one detail level. They share a group, since drawing needs only the voxel size of a run.
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
    // Returns a group for points of the run. It has room for one more brick: it holds fewer than kWaiting points.
    Group &group_of(const RunGeometry &run, int block);
    std::span<const std::unique_ptr<Group>> groups() const { return std::span(groups_).first(used_); }

  private:
    Group &add(const RunGeometry &run, int block);

    std::size_t used_ = 0;
    std::vector<std::unique_ptr<Group>> groups_;
    std::vector<Group *> open_; // one of each level and kind
};

} // namespace pbm
