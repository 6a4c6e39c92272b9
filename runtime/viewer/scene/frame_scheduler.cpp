#include "viewer/scene/frame_scheduler.h"

#include <algorithm>
#include <cassert>
#include <limits>

namespace pbm {

FrameScheduler::FrameScheduler(double max_error, double min_fps)
    : exact_(max_error),
      moving_budget_(min_fps > 0 ? kDrawingShare / min_fps : std::numeric_limits<double>::infinity()) {
    assert(max_error > 0 && min_fps >= 0);
}

void FrameScheduler::view_changed(double now) {
    shown_.reset();
    changed_ = now;
}

void FrameScheduler::arrived(bool all) {
    if (all)
        news_ = News::all;
    else if (news_ == News::none)
        news_ = News::some;
}

void FrameScheduler::drawn(const Picture &picture, double now) {
    if (!shown_)
        quick_ = picture.max_error;
    shown_ = picture;
    news_ = News::none;
    drawn_at_ = now;
    if (picture.points > 0)
        seconds_per_point_ = picture.seconds / static_cast<double>(picture.points);
}

std::optional<FrameScheduler::Step> FrameScheduler::next(double now, const PointsAt &points_at) const {
    if (const auto when = due(); !when || now < *when)
        return std::nullopt;
    if (!shown_)
        return Step{quick_error(points_at), true};
    return Step{exact_, expected_seconds(points_at(exact_)) <= kFrameBudget};
}

std::optional<double> FrameScheduler::due() const {
    if (!shown_)
        return changed_.value_or(0);
    if (!is_exact())
        return changed_ ? *changed_ + kRest : 0;
    if (complete() || news_ == News::none)
        return std::nullopt;
    return news_ == News::all ? drawn_at_ : drawn_at_ + kPause * shown_->seconds;
}

double FrameScheduler::quick_error(const PointsAt &points_at) const {
    double error = exact_;
    const auto fits = [&] {
        const std::uint64_t points = points_at(error);
        const bool finer = quick_ && error < *quick_;
        return points <= kFewPoints ||
               expected_seconds(points) <= (finer ? (1 - kReserve) * moving_budget_ : moving_budget_);
    };
    while (error < kLargestError && !fits())
        error *= kErrorStep;
    return error;
}

} // namespace pbm
