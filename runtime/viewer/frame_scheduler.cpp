#include "viewer/frame_scheduler.h"

#include <algorithm>
#include <cassert>

namespace pbm {

std::vector<std::uint64_t> level_points(const Model &model) {
    std::vector<std::uint64_t> points;
    for (const Level &level : model.levels)
        points.push_back(level.points.size());
    return points;
}

FrameScheduler::FrameScheduler(std::vector<std::uint64_t> points, int finest)
    : points_(std::move(points)), finest_(std::min(finest, static_cast<int>(points_.size()) - 1)) {
    assert(finest_ >= 0);
}

void FrameScheduler::view_changed(double now) {
    shown_.reset();
    changed_ = now;
}

void FrameScheduler::drawn(int level, double seconds) {
    if (!shown_)
        quick_ = level;
    shown_ = level;
    seconds_per_point_ = seconds / static_cast<double>(points_[static_cast<std::size_t>(level)]);
}

std::optional<FrameScheduler::Step> FrameScheduler::next(double now) const {
    if (!shown_)
        return Step{quick_level(), true};
    if (complete() || now < changed_ + kRest)
        return std::nullopt;
    return Step{*shown_ + 1, expected_seconds(*shown_ + 1) <= kFrameBudget};
}

std::optional<double> FrameScheduler::due() const {
    if (!shown_)
        return changed_;
    return complete() ? std::nullopt : std::optional(changed_ + kRest);
}

double FrameScheduler::expected_seconds(int level) const {
    return seconds_per_point_ * static_cast<double>(points_[static_cast<std::size_t>(level)]);
}

int FrameScheduler::quick_level() const {
    const auto fits = [this](int level) {
        const bool finer = quick_ && level > *quick_;
        return expected_seconds(level) <= (finer ? (1 - kReserve) * kFrameBudget : kFrameBudget) ||
               points_[static_cast<std::size_t>(level)] <= kFewPoints;
    };
    int level = finest_;
    while (level > 0 && !fits(level))
        --level;
    return level;
}

} // namespace pbm
