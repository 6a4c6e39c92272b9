// Decides how fine the next picture is and when it is due: as fine as the frame rate allows while the view moves, at
// full detail when it rests, again when chunks have arrived. Times are parameters, in seconds of any clock.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

namespace pbm {

class FrameScheduler {
  public:
    // A picture that may take longer is drawn on another thread, so that the window responds.
    static constexpr double kFrameBudget = 0.040;
    // Share of a moving frame's time for drawing it; showing it takes the rest.
    static constexpr double kDrawingShare = 0.8;
    // A moving view gets finer only if that is expected to leave this share of its time unused: detail that flickers
    // from frame to frame is worse than less detail.
    static constexpr double kReserve = 0.4;
    // A view that has not changed for this long rests.
    static constexpr double kRest = 0.1;
    // A view whose picture has been shown for this long without a change of the view is refined: longer than two events
    // of a mouse are apart.
    static constexpr double kStill = 0.02;
    // Fewer points than this cost less than their pixels: a larger error would not save time.
    static constexpr std::uint64_t kFewPoints = 100'000;
    // From one picture of a moving view to the next its error changes by at most this factor, so that chunks change
    // their level one after another; if a picture would take more than twice its time, by at most kHurriedStep.
    static constexpr double kErrorStep = 1.03, kHurriedStep = 1.2;
    // Pixels. Voxels up to this width are drawn as blocks of pixels, larger ones as ellipses, whose time is that of the
    // pixels that they cover: a larger error would save hardly any time.
    static constexpr double kLargestError = 2.1;
    // A moving view gets coarser only if the largest error leaves out at least this part of the points. A small model,
    // and a close view of any model, is drawn at its finest level whatever the error: its time is that of the pixels.
    static constexpr double kMinSaving = 0.1;
    // Pause after a picture while chunks arrive, in durations of the picture: decoding needs the same processors.
    static constexpr double kPause = 2;

    // Largest edges of drawn voxels, pixels.
    struct Errors {
        double still;  // of a view at rest: the exact error
        double moving; // of a moving view, the least
    };
    struct Step {
        double max_error; // pixels
        bool at_once;     // expected to stay within the budget, or there is nothing to show yet
    };
    struct Picture {
        double max_error;     // used for drawing
        std::uint64_t points; // to be drawn
        bool complete;        // no chunk was missing
        double seconds;       // duration
    };
    // Number of points to draw at an error.
    using PointsAt = std::function<std::uint64_t(double max_error)>;

    // Starts at rest: the first picture is exact where time allows. `min_fps`: frames per second of a moving view, 0:
    // any.
    FrameScheduler(const Errors &errors, double min_fps);

    // The picture shown is out of date; further changes may follow.
    void view_changed(double now, const Errors &errors);
    // Chunks of the view have arrived; `all`: no more will come.
    void arrived(bool all);
    // The view looks different at full detail only: the picture shown stays until the new one is drawn.
    void restyled();
    // A refined picture is shown, which has full detail.
    void refined();
    // The picture of the current view is shown.
    void drawn(const Picture &picture, double now);

    // What to draw now, if anything. The answer stays the same until something was drawn, has arrived or has changed.
    std::optional<Step> next(double now, const PointsAt &points_at) const;
    // When `next` will have an answer; absent if that needs an arrival or a change.
    std::optional<double> due() const;
    // When the picture of the current view may be refined: once the view rests. Absent before it has a picture, while
    // an exact one lacks chunks, and for the first view of a model before its picture is exact.
    std::optional<double> refinement_due() const;
    // When the view changed last; absent before it has.
    std::optional<double> changed() const { return changed_; }
    // The picture of the current view, if there is one.
    const std::optional<Picture> &shown() const { return shown_; }
    // Whether that picture has full detail.
    bool complete() const { return shown_ && is_exact() && shown_->complete; }

  private:
    enum class News { none, some, all };

    bool is_exact() const { return shown_->max_error <= errors_.still; }
    double expected_seconds(std::uint64_t points) const { return seconds_per_point_ * static_cast<double>(points); }
    // Whether a moving picture at this error takes no more than this part of its time.
    bool fits(double error, double part, const PointsAt &points_at) const;
    double quick_error(const PointsAt &points_at) const;

    Errors errors_;
    double moving_budget_; // seconds
    std::optional<Picture> shown_;
    News news_ = News::none;        // since the last picture
    std::optional<double> quick_;   // of the motion's last picture; absent before its first
    std::optional<double> changed_; // last change of the view
    double drawn_at_ = 0;
    // Cost of a point in the last picture. The initial value is a guess for a slow computer.
    double seconds_per_point_ = 10e-9;
};

} // namespace pbm
