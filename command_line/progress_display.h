// Progress of a long job on stderr: a bar on a terminal, plain lines otherwise.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>

namespace pbm::command_line {

enum class Verbosity { quiet, normal, verbose };

class ProgressDisplay {
  public:
    // Silent if quiet. A bar if stderr is a terminal. Else a line per step, with `verbose` at once, and otherwise only
    // for steps that begin when the job has run for five seconds.
    explicit ProgressDisplay(Verbosity verbosity);
    ~ProgressDisplay() { clear(); }
    ProgressDisplay(const ProgressDisplay &) = delete;
    ProgressDisplay &operator=(const ProgressDisplay &) = delete;

    void show(std::string_view step, double done); // from any thread
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
