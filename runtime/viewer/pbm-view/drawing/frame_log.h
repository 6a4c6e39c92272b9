// What -v says of each frame that the window shows.
#pragma once

#include "viewer/pbm-view/drawing/pictures.h"
#include "viewer/pbm-view/window/view_text.h"

#include <chrono>
#include <iostream>
#include <utility>

namespace pbm {

class FrameLog {
  public:
    using Clock = std::chrono::steady_clock;

    // Created with the OpenGL context; `start`: when the program started.
    explicit FrameLog(Clock::time_point start) : start_(start), context_(Window::now()) {}

    std::uint64_t frames() const { return frames_; }
    // Counts a frame that is shown.
    void count() { ++frames_; }
    // Says what it shows; `glides`: the camera does.
    void report(const Shown &shown, const Pictures &pictures, bool glides) {
        std::cout << "frame " << frames_ << ": ";
        if (!pictures.is_shown()) {
            std::cout << "no picture yet" << std::endl;
            return;
        }
        const int samples = pictures.samples();
        std::cout << cost_line(pictures.drawn(), shown.model->depth(), shown.size, shown.model->streamed().statistics())
                  << (samples > 0 ? "fine, " + std::to_string(samples) + " of " +
                                        std::to_string(shown.look->options.samples) + " samples"
                      : glides              ? "gliding"
                      : pictures.is_exact() ? "exact"
                                            : "coarse, " + std::to_string(pictures.drawn().missing) + " chunks missing")
                  << '\n';
        report_time("first", first_picture_);
        if (pictures.is_exact())
            report_time("exact", exact_picture_);
        if (const auto changed = pictures.changed(); changed && samples > 0 && fine_ != std::pair(*changed, samples)) {
            fine_ = {*changed, samples};
            std::cout << "fine picture: " << milliseconds(Window::now() - *changed) << " after the view changed, "
                      << samples << " samples\n";
        }
        std::cout << std::flush;
    }

  private:
    void report_time(const char *what, bool &is_due) const {
        if (!std::exchange(is_due, false))
            return;
        const std::chrono::duration<double> since_start = Clock::now() - start_;
        std::cout << what << " picture: " << milliseconds(since_start.count()) << " after the start, "
                  << milliseconds(Window::now() - context_) << " after the OpenGL context\n";
    }

    const Clock::time_point start_;
    const double context_; // window's clock
    std::uint64_t frames_ = 0;
    bool first_picture_ = true, exact_picture_ = true; // not yet reported
    std::pair<double, int> fine_{};                    // the last one: change of the view, samples
};

} // namespace pbm
