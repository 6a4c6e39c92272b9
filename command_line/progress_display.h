// Shows the progress of a long job on stderr: a bar on a terminal, lines otherwise.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>

namespace pbm::command_line {

enum class Verbosity { quiet, normal, verbose };

class ProgressDisplay {
  public:
    // Shows nothing if `verbosity` is quiet, a bar if stderr is a terminal, else one line per step: with `verbose` from
    // the start, otherwise only for steps that start after five seconds.
    explicit ProgressDisplay(Verbosity verbosity);
    ~ProgressDisplay() { clear(); }
    ProgressDisplay(const ProgressDisplay &) = delete;
    ProgressDisplay &operator=(const ProgressDisplay &) = delete;

    void show(std::string_view step, double done); // thread-safe
    void clear();                                  // removes the bar

  private:
    using Clock = std::chrono::steady_clock;

    std::mutex mutex_;
    Verbosity verbosity_;
    bool terminal_;
    bool bar_shown_ = false;
    std::string step_; // shown last
    Clock::time_point begin_ = Clock::now();
    Clock::time_point drawn_{};
};

} // namespace pbm::command_line
