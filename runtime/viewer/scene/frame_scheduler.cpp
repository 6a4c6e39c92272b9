#include "viewer/scene/frame_scheduler.h"

#include <algorithm>
#include <cassert>
#include <limits>

namespace pbm {

FrameScheduler::FrameScheduler(const Errors &errors, double min_fps)
    : errors_(errors), moving_budget_(min_fps > 0 ? kDrawingShare / min_fps : std::numeric_limits<double>::infinity()) {
    assert(errors.still > 0 && errors.still <= errors.moving && min_fps >= 0);
}

void FrameScheduler::view_changed(double now, const Errors &errors) {
    errors_ = errors;
    shown_.reset();
    if (!changed_ || now > *changed_ + kRest)
        quick_.reset();
    changed_ = now;
}

void FrameScheduler::arrived(bool all) {
    if (all)
        news_ = News::all;
    else if (news_ == News::none)
        news_ = News::some;
}

void FrameScheduler::restyled() {
    if (shown_)
        shown_->complete = false;
    news_ = News::all;
}

void FrameScheduler::refined() {
    if (!shown_)
        return;
    shown_->max_error = errors_.still;
    shown_->complete = true;
    news_ = News::none;
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
    return Step{errors_.still, expected_seconds(points_at(errors_.still)) <= kFrameBudget};
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

std::optional<double> FrameScheduler::refinement_due() const {
    if (!shown_ || ((!changed_ || is_exact()) && !complete()))
        return std::nullopt;
    return changed_ ? std::max(*changed_, drawn_at_) + kStill : 0;
}

bool FrameScheduler::fits(double error, double part, const PointsAt &points_at) const {
    const std::uint64_t points = points_at(error);
    return points <= kFewPoints || expected_seconds(points) <= part * moving_budget_;
}

double FrameScheduler::quick_error(const PointsAt &points_at) const {
    const double least = changed_ ? errors_.moving : errors_.still, largest = std::max(least, kLargestError);
    if (static_cast<double>(points_at(largest)) > (1 - kMinSaving) * static_cast<double>(points_at(errors_.still)))
        return errors_.still;
    if (!quick_) { // the first picture of a motion
        double error = least;
        while (error < largest && !fits(error, 1, points_at))
            error = std::min(error * kErrorStep, largest);
        return error;
    }
    if (!fits(*quick_, 1, points_at))
        return std::min(*quick_ * (fits(*quick_, 2, points_at) ? kErrorStep : kHurriedStep), largest);
    const double finer = std::max(*quick_ / kErrorStep, least);
    return fits(finer, 1 - kReserve, points_at) ? finer : *quick_;
}

} // namespace pbm
