// Which detail level to draw next, and when: coarse at once while the view changes, finer step by step when it rests.
// Knows time only through what it is told; seconds of any clock.
#pragma once

#include "pbm_format/model.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace pbm {

// Number of points of every level 0..finest.
std::vector<std::uint64_t> level_points(const Model &model);

class FrameScheduler {
  public:
    // A picture that may take longer than this belongs on another thread: the window would not answer meanwhile.
    static constexpr double kFrameBudget = 0.040;
    // A moving view gets finer only where that is expected to leave so much of the budget unused: detail that comes and
    // goes with every frame is worse than less of it.
    static constexpr double kReserve = 0.4;
    // A view that has not changed for this long rests.
    static constexpr double kRest = 0.1;
    // Fewer points than this take less time than their pixels: a coarser level would gain nothing.
    static constexpr std::uint64_t kFewPoints = 100'000;

    struct Step {
        int level;
        bool at_once; // expected to take no longer than the budget, or there is nothing to show yet
    };

    // `points` as level_points, not empty. Levels above `finest` are not drawn.
    FrameScheduler(std::vector<std::uint64_t> points, int finest);

    // The picture shown is out of date.
    void view_changed(double now);
    // The picture of the present view took `seconds` at `level` and is shown.
    void drawn(int level, double seconds);

    // What to draw now, if anything. Asking again gives the same answer until something was drawn or changed.
    std::optional<Step> next(double now) const;
    // When `next` will have an answer; nothing if the finest picture is there.
    std::optional<double> due() const;
    // The level of the picture of the present view, if there is one.
    std::optional<int> shown() const { return shown_; }
    bool complete() const { return shown_ && *shown_ == finest_; }

  private:
    double expected_seconds(int level) const;
    int quick_level() const;

    std::vector<std::uint64_t> points_;
    int finest_;
    std::optional<int> shown_;
    std::optional<int> quick_; // level of the last picture drawn at once for a new view
    double changed_ = 0;
    // The last picture drawn says what a point costs. Until then: a slow computer's guess.
    double seconds_per_point_ = 40e-9;
};

} // namespace pbm
