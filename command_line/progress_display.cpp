#include "command_line/progress_display.h"

#include "command_line/error_log.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include <unistd.h>

namespace pbm::command_line {
namespace {

constexpr int kBarWidth = 30;
constexpr std::chrono::milliseconds kRedraw{100};
constexpr std::chrono::seconds kLong{5};

// Whether stderr is a terminal that draws over a line. A dumb one, or one that nobody names, keeps what it shows.
bool is_terminal() {
    const char *const kind = std::getenv("TERM");
    return isatty(STDERR_FILENO) == 1 && kind != nullptr && *kind != '\0' && std::string_view(kind) != "dumb";
}

} // namespace

ProgressDisplay::ProgressDisplay(Verbosity verbosity, bool for_programs)
    : verbosity_(verbosity), for_programs_(for_programs), terminal_(is_terminal()) {}

void ProgressDisplay::show_to_programs(std::string_view step, double done, std::string_view note) {
    const int percent = static_cast<int>(std::clamp(done, 0.0, 1.0) * 100);
    if (step == step_ && percent == percent_ && note == note_)
        return;
    percent_ = percent;
    step_ = step;
    note_ = note;
    std::printf("%d %.*s%s%.*s\n", percent, static_cast<int>(step.size()), step.data(), note.empty() ? "" : ", ",
                static_cast<int>(note.size()), note.data());
    if (std::fflush(stdout) != 0)
        std::_Exit(2);
}

void ProgressDisplay::show(std::string_view step, double done, std::string_view note) {
    if (verbosity_ < Verbosity::normal && !for_programs_)
        return;
    const std::lock_guard lock(mutex_);
    if (for_programs_)
        return show_to_programs(step, done, note);
    const auto now = Clock::now();
    const bool first = step != step_;
    if (first && verbosity_ == Verbosity::verbose)
        log_line(LogKind::progress, step);
    if (!terminal_) {
        if (first && (verbosity_ == Verbosity::verbose || now - begin_ >= kLong))
            std::fprintf(stderr, "%.*s ...\n", static_cast<int>(step.size()), step.data());
    } else if (now - drawn_ >= kRedraw) {
        const int filled = static_cast<int>(std::clamp(done, 0.0, 1.0) * kBarWidth);
        const std::string bar(static_cast<std::size_t>(filled), '=');
        erase();
        bar_columns_ = std::fprintf(stderr, "%-14.*s [%-*s] %.*s", static_cast<int>(step.size()), step.data(),
                                    kBarWidth, bar.c_str(), static_cast<int>(note.size()), note.data());
        std::fflush(stderr);
        drawn_ = now;
    }
    step_ = step;
}

void ProgressDisplay::clear() {
    const std::lock_guard lock(mutex_);
    erase();
}

// By spaces: a terminal need not know escape sequences.
void ProgressDisplay::erase() {
    if (bar_columns_ > 0)
        std::fprintf(stderr, "\r%*s\r", bar_columns_, "");
    bar_columns_ = 0;
}

} // namespace pbm::command_line
