// The runs of a picture and what a view sees of them: what every renderer of runs starts with.
#pragma once

#include "pbm_render/bricks/brick_culling.h"
#include "pbm_render/picture/render_options.h"
#include "pbm_surface/surface_offsets.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// Where a run's part of the picture is.
struct DrawnRun {
    RunGeometry geometry;
    std::size_t first_brick = 0, seen = 0; // in the list's bricks
    int top = 0, bottom = 0;               // rows
};

// Ids of points: the number of a run and, below, that of the point within its chunk.
struct PointIds {
    int point_bits;

    std::uint32_t first_of(std::size_t run) const { return static_cast<std::uint32_t>(run) << point_bits; }
    std::size_t run(std::uint32_t id) const { return id >> point_bits; }
    std::size_t point(std::uint32_t id) const { return id & ((1U << point_bits) - 1); }
};

class DrawnRuns {
  public:
    // Chunks hold `chunk_points` points at most.
    explicit DrawnRuns(std::uint32_t chunk_points);

    // What is drawn from now on: copies of as many runs as ids can tell.
    void set(std::span<const PointRun> runs);
    // Of all runs: level and points.
    RenderStatistics statistics() const;
    std::size_t size() const { return runs_.size(); }

    // For a view: makes room first, then find what each run shows; runs may be culled by several threads at a time,
    // each with a workplace of its own. `frame` must outlive what is done with them. `widen(run, bricks)` may change
    // the bricks' rows.
    void begin_view(const FrameGeometry &frame);
    template <class Widen>
    void cull(std::size_t run, const FrameGeometry &frame, SurfaceOffsets &workplace, Widen &&widen) {
        widen(drawn_[run].geometry, find_seen(run, frame, workplace));
        find_rows(run, frame);
    }
    void cull(std::size_t run, const FrameGeometry &frame, SurfaceOffsets &workplace) {
        cull(run, frame, workplace, [](const RunGeometry &, std::span<SeenBrick>) {});
    }

    // work(run, its seen bricks, id of its chunk's first point) for runs that touch rows top .. bottom - 1.
    template <class Work> void for_each_in_rows(int top, int bottom, Work &&work) const {
        for (std::size_t i = 0; i < drawn_.size(); ++i)
            if (const DrawnRun &run = drawn_[i]; run.top < bottom && run.bottom > top)
                work(run.geometry, std::span(bricks_).subspan(run.first_brick, run.seen), ids_.first_of(i));
    }

    // A copy for loops that write: they need not read it again.
    PointIds ids() const { return ids_; }
    const PointRun &operator[](std::size_t run) const { return runs_[run]; }

  private:
    std::span<SeenBrick> find_seen(std::size_t run, const FrameGeometry &frame, SurfaceOffsets &workplace);
    void find_rows(std::size_t run, const FrameGeometry &frame);

    PointIds ids_;
    std::vector<PointRun> runs_;
    std::vector<DrawnRun> drawn_; // [runs]
    std::vector<SeenBrick> bricks_;
};

} // namespace pbm
