// The one way from argv through CLI11 to an exit code. Included where command lines are declared only: CLI11 takes
// seconds to compile.
#pragma once

#include "command_line/command_line.h"
#include "command_line/error_log.h"
#include "command_line/help.h"
#include "command_line/spelling.h"

#include <CLI/CLI.hpp>

#include <optional>

namespace pbm::command_line {

// What help says beyond the options themselves.
struct Manual {
    std::vector<std::string> most_used{}; // long names on the first page; empty: the options with a short name
    std::vector<Example> examples{};
    std::string run_time_limits{}; // what ends with exit code 4 beside memory
    bool logs_steps = false;       // with -v and --log
};

// Thrown by what handles an option: the error is about `path`.
struct Refusal {
    std::string path;
    Error error;
};

// A value names a file if its type says FILE, if it is the output, or if it needs no option's name.
bool names_file(const CLI::Option &option);

// The same of one value: a type like FILE|default has words beside names of files.
bool names_file(const CLI::Option &option, const std::string &value);

namespace detail {

// "N" for numbers, "565|888" for words; CLI11 says INT:INT in [5 - 16] and TEXT:{565,888}.
std::string value_name(const CLI::Option &option);

// What was given first, empty for nothing.
std::string first_result(const CLI::Option *option);

} // namespace detail

// Parses; returns the exit code of a program that has said all it had to say (help, version, a usage error), or
// nothing when it may go on. Adds what all programs have: --help TOPIC and --log FILE.
std::optional<int> parse(CLI::App &app, std::string_view program, int argc, char **argv,
                         std::span<const OldSwitch> switches = {}, const Manual &manual = {});

} // namespace pbm::command_line
