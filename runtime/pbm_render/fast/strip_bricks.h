// The bricks that touch a strip of the picture, roughly from front to back, so that later ones are often hidden. Bricks
// of backs alone come last, since the backs of closed surfaces are always hidden.
#pragma once

#include "pbm_render/bricks/drawn_runs.h"

#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

class StripBricks {
  public:
    struct Run {
        const RunGeometry *geometry;
        std::span<const VisibleBrick> seen;
        std::uint32_t first_id; // of the chunk's first point
    };
    struct Brick {
        std::uint32_t run, seen; // indices of the run and of the brick in Run::seen
        bool only_backs;         // all its points face away
    };

    // Lists the bricks of `drawn` that touch rows top .. bottom - 1. `drawn` must outlive the use of the list.
    void collect(const DrawnRuns &drawn, int top, int bottom);

    // Sorted into a few classes of depth, nearest first: bricks with fronts, then bricks of backs alone. Within a class
    // they keep the order of the runs and of their bricks.
    std::span<const Brick> bricks() const { return bricks_; }
    const Run &run(std::uint32_t index) const { return runs_[index]; }

  private:
    std::vector<Run> runs_;
    std::vector<Brick> unsorted_, bricks_;
};

} // namespace pbm
