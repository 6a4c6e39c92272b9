// The runs of a picture and their visible bricks: the first step of every renderer of runs.
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/bricks/point_ids.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// Visible bricks of a run, and the rows that they touch.
struct DrawnRun {
    RunGeometry geometry;
    std::size_t first_brick = 0, seen = 0; // range in the list's bricks
    int top = 0, bottom = 0;               // rows
};

class DrawnRuns {
  public:
    // `chunk_points`: the maximum number of points per chunk.
    explicit DrawnRuns(std::uint32_t chunk_points);

    // Copies the runs to draw, as many as ids can number.
    void set(std::span<const PointRun> runs);
    // Level and points of all runs.
    RenderStatistics statistics() const;
    std::size_t size() const { return runs_.size(); }

    // Starts a view. Then `cull` finds the visible bricks of a run; threads may cull different runs. `frame` must
    // outlive the use of the results. `widen(run, bricks)` may change the rows of bricks.
    void begin_view(const FrameGeometry &frame);
    template <class Widen> void cull(std::size_t run, const FrameGeometry &frame, Widen &&widen) {
        widen(drawn_[run].geometry, find_visible(run, frame));
        find_rows(run, frame);
    }
    void cull(std::size_t run, const FrameGeometry &frame) {
        cull(run, frame, [](const RunGeometry &, std::span<VisibleBrick>) {});
    }
    // Estimates the surface offsets of those visible bricks of a run that face the eye, if it has offsets. Call this
    // after `cull`; threads may do so for different runs.
    void estimate_offsets(std::size_t run) const;

    // Calls work(run, its seen bricks, id of its chunk's first point) for runs that touch rows top .. bottom - 1.
    template <class Work> void for_each_in_rows(int top, int bottom, Work &&work) const {
        for (std::size_t i = 0; i < drawn_.size(); ++i)
            if (const DrawnRun &run = drawn_[i]; run.top < bottom && run.bottom > top)
                work(run.geometry, std::span(bricks_).subspan(run.first_brick, run.seen), ids_.first_of(i));
    }

    // A copy, so that loops which write need not read it again.
    PointIds ids() const { return ids_; }
    const PointRun &operator[](std::size_t run) const { return runs_[run]; }

  private:
    std::span<VisibleBrick> find_visible(std::size_t run, const FrameGeometry &frame);
    void find_rows(std::size_t run, const FrameGeometry &frame);

    PointIds ids_;
    std::vector<PointRun> runs_;
    std::vector<DrawnRun> drawn_; // [runs]
    std::vector<VisibleBrick> bricks_;
};

} // namespace pbm
