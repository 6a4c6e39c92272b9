#include "pbm_render/bricks/drawn_runs.h"

#include "pbm_render/bricks/chunk_offsets.h"

#include <algorithm>
#include <bit>

namespace pbm {

DrawnRuns::DrawnRuns(std::uint32_t chunk_points) : ids_{static_cast<int>(std::bit_width(chunk_points - 1))} {}

void DrawnRuns::set(std::span<const PointRun> runs) {
    runs = runs.first(std::min(runs.size(), ids_.max_runs()));
    runs_.assign(runs.begin(), runs.end());
    std::size_t bricks = 0;
    for (const PointRun &run : runs_)
        bricks += run.chunk->bricks.size();
    if (bricks_.size() < bricks)
        bricks_.resize(bricks);
}

RenderStatistics DrawnRuns::statistics() const {
    RenderStatistics statistics;
    for (const PointRun &run : runs_) {
        statistics.level = std::max(statistics.level, run.level);
        statistics.points += run.last - run.first;
    }
    return statistics;
}

void DrawnRuns::begin_view(const FrameGeometry &frame) {
    drawn_.clear();
    std::size_t bricks = 0;
    for (const PointRun &run : runs_) {
        drawn_.push_back({RunGeometry(run, frame), bricks});
        bricks += run.chunk->bricks.size();
    }
}

std::span<VisibleBrick> DrawnRuns::find_visible(std::size_t index, const FrameGeometry &frame) {
    DrawnRun &run = drawn_[index];
    const std::span<VisibleBrick> room(bricks_.data() + run.first_brick, run.geometry.run->chunk->bricks.size());
    run.seen = find_visible_bricks(run.geometry, frame, room);
    return room.first(run.seen);
}

void DrawnRuns::estimate_offsets(std::size_t index) const {
    const DrawnRun &run = drawn_[index];
    if (const ChunkOffsets *offsets = runs_[index].offsets; offsets != nullptr && run.seen > 0)
        offsets->estimate(*runs_[index].chunk, std::span(bricks_).subspan(run.first_brick, run.seen));
}

void DrawnRuns::find_rows(std::size_t index, const FrameGeometry &frame) {
    DrawnRun &run = drawn_[index];
    run.top = frame.height;
    run.bottom = 0;
    for (const VisibleBrick &brick : std::span(bricks_).subspan(run.first_brick, run.seen)) {
        run.top = std::min(run.top, brick.top);
        run.bottom = std::max(run.bottom, brick.bottom);
    }
}

} // namespace pbm
