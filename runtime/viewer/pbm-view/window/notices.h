// What the program says: notices over the picture, lines on standard output and on standard error.
#pragma once

#include "viewer/pbm-view/window/window.h"

#include "command_line/command_line.h"
#include "command_line/progress_display.h"

#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace pbm {

class Notices {
  public:
    static constexpr double kNoticeTime = 4, kProblemTime = 10; // seconds

    // `program` and `window` must outlive it.
    Notices(std::string_view program, command_line::Verbosity verbosity, Window &window)
        : program_(program), verbosity_(verbosity), window_(window) {}

    std::string_view program() const { return program_; }
    bool verbose() const { return verbosity_ == command_line::Verbosity::verbose; }

    // Shows a notice in place of the last one.
    void notify(std::string text, bool is_problem = false) {
        text_ = std::move(text);
        is_problem_ = is_problem;
        until_ = Window::now() + (is_problem ? kProblemTime : kNoticeTime);
        window_.invalidate();
    }
    // A line on standard output, unless the program is quiet.
    void print(const std::string &line) const {
        if (verbosity_ != command_line::Verbosity::quiet)
            std::cout << line << std::endl;
    }
    // A line on standard error: what is wrong with the file at `path`. Returns the exit code.
    int fail(std::string_view path, const Error &error) const { return command_line::fail(program_, path, error); }
    // A line on standard error, unless the program is quiet, and a notice.
    void warn(const std::string &message) {
        if (verbosity_ != command_line::Verbosity::quiet)
            command_line::warn(program_, message);
        notify(message, true);
    }
    // Says which file was saved, or why it was not.
    void report_saved(const Result<std::string> &path) {
        path ? print("saved " + *path) : static_cast<void>(fail("", path.error()));
        notify(path ? "Saved " + std::filesystem::absolute(*path).string() : path.error().message, !path);
    }

    // The notice shown; empty for none.
    const std::string &text() const { return text_; }
    bool is_problem() const { return is_problem_; }
    // Until when, window's clock; absent without a notice.
    std::optional<double> until() const { return text_.empty() ? std::nullopt : std::optional(until_); }
    // Removes a notice whose time is over.
    void serve() {
        if (text_.empty() || Window::now() < until_)
            return;
        text_.clear();
        window_.invalidate();
    }

  private:
    const std::string_view program_;
    const command_line::Verbosity verbosity_;
    Window &window_;
    std::string text_;
    bool is_problem_ = false;
    double until_ = 0;
};

} // namespace pbm
