// How fine the next picture may be, and when it is due: as fine as the frame rate allows while the view moves, exact
// when it rests, again when there is more to draw it with. Knows time only through what it is told; seconds of any
// clock.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

namespace pbm {

class FrameScheduler {
  public:
    // A picture that may take longer than this belongs on another thread: the window would not answer meanwhile.
    static constexpr double kFrameBudget = 0.040;
    // Of a moving frame's time; showing it takes the rest.
    static constexpr double kDrawingShare = 0.8;
    // A moving view gets finer only where that is expected to leave so much of its time unused: detail that comes and
    // goes with every frame is worse than less of it.
    static constexpr double kReserve = 0.4;
    // A view that has not changed for this long rests.
    static constexpr double kRest = 0.1;
    // Fewer points than this take less time than their pixels: a larger error would gain nothing.
    static constexpr std::uint64_t kFewPoints = 100'000;
    // Errors are multiples of the exact one by powers of this: four steps are one detail level.
    static constexpr double kErrorStep = 1.189207115002721;
    static constexpr double kLargestError = 64; // pixels
    // While chunks arrive, after a picture: as many times as long as it took. They need the same processors.
    static constexpr double kPause = 2;

    struct Step {
        double max_error; // pixels
        bool at_once;     // expected to take no longer than the budget, or there is nothing to show yet
    };
    struct Picture {
        double max_error;     // it was drawn with
        std::uint64_t points; // that were to be drawn
        bool complete;        // nothing that was asked for was missing
        double seconds;       // it took
    };
    // How many points there are to draw at an error.
    using PointsAt = std::function<std::uint64_t(double max_error)>;

    // A view at rest. `max_error` is the exact one, pixels; `min_fps`: frames per second while the view moves, 0: any.
    FrameScheduler(double max_error, double min_fps);

    // The picture shown is out of date, and more such changes may follow.
    void view_changed(double now);
    // There is more to draw the view with; `all`: and nothing more to come.
    void arrived(bool all);
    // The picture of the present view is shown.
    void drawn(const Picture &picture, double now);

    // What to draw now, if anything. Asking again gives the same answer until something was drawn, arrived or changed.
    std::optional<Step> next(double now, const PointsAt &points_at) const;
    // When `next` will have an answer; nothing if only arrivals or changes can bring one.
    std::optional<double> due() const;
    // The picture of the present view, if there is one.
    const std::optional<Picture> &shown() const { return shown_; }
    // Whether that has all it may have.
    bool complete() const { return shown_ && is_exact() && shown_->complete; }

  private:
    enum class News { none, some, all };

    bool is_exact() const { return shown_->max_error <= exact_; }
    double expected_seconds(std::uint64_t points) const { return seconds_per_point_ * static_cast<double>(points); }
    double quick_error(const PointsAt &points_at) const;

    double exact_, moving_budget_; // pixels, seconds
    std::optional<Picture> shown_;
    News news_ = News::none;        // since it was drawn
    std::optional<double> quick_;   // error of the last picture drawn at once for a new view
    std::optional<double> changed_; // when the view moved last
    double drawn_at_ = 0;
    // The last picture drawn says what a point costs. Until then: a small computer's guess.
    double seconds_per_point_ = 10e-9;
};

} // namespace pbm
