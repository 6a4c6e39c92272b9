// Shows the progress of a long job: on stderr a bar on a terminal, lines otherwise; or on stdout for a program.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>

namespace pbm::command_line {

enum class Verbosity { quiet, warnings, normal, verbose }; // each says what those before say, and more

class ProgressDisplay {
  public:
    // Shows nothing if `verbosity` is less than normal, a bar if stderr is a terminal and TERM neither dumb nor unset,
    // else one line per step: with `verbose` from the start, otherwise only for steps that start after five seconds.
    // With `for_programs`, whatever `verbosity`: the lines of --progress on stdout instead. If nobody reads them any
    // more, the process ends with exit code 2: the program that asked for the job has ended.
    explicit ProgressDisplay(Verbosity verbosity, bool for_programs = false);
    ~ProgressDisplay() { clear(); }
    ProgressDisplay(const ProgressDisplay &) = delete;
    ProgressDisplay &operator=(const ProgressDisplay &) = delete;

    // Thread-safe. `note`: shown behind a bar and to programs.
    void show(std::string_view step, double done, std::string_view note = {});
    void clear(); // removes the bar

  private:
    using Clock = std::chrono::steady_clock;

    void erase();
    void show_to_programs(std::string_view step, double done, std::string_view note);

    std::mutex mutex_;
    Verbosity verbosity_;
    bool for_programs_, terminal_;
    int percent_ = -1;        // shown last
    int bar_columns_ = 0;     // of the bar shown
    std::string step_, note_; // shown last
    Clock::time_point begin_ = Clock::now();
    Clock::time_point drawn_{};
};

} // namespace pbm::command_line
