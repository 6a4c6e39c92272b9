// The one way from argv through CLI11 to an exit code. Included by main.cpp files only: CLI11 takes seconds to compile.
#pragma once

#include "command_line/command_line.h"

#include <CLI/CLI.hpp>

#include <optional>

namespace pbm::command_line {

// Parses; returns the exit code of a program that has said all it had to say (help, version, a usage error, a switch
// that is not in this version), or nothing when it may go on.
inline std::optional<int> parse(CLI::App &app, std::string_view program, int argc, char **argv,
                                std::span<const OldSwitch> switches = {}) {
    auto given = arguments(argc, argv, switches);
    if (!given)
        return fail(program, "", given.error());
    try {
        app.parse(std::move(given).value());
    } catch (const CLI::Success &done) {
        return app.exit(done);
    } catch (const CLI::ParseError &error) {
        return fail_usage(program, error.what());
    }
    return std::nullopt;
}

} // namespace pbm::command_line
