// The error log that --log names: errors, warnings and progress of a program, one line each, added at its end. A
// process has one, as it has one standard error.
#pragma once

#include "system/error.h"

#include <string>
#include <string_view>

namespace pbm::command_line {

enum class LogKind { error, warning, progress };

// Opens `path` for `program`; makes the file if it is not there, and adds to it if it is. Several processes may share a
// log: each line is written at once. Call before there are other threads.
//
// errors  io  the system's own text
Status open_log(std::string_view program, const std::string &path);

// Its name; empty without a log.
const std::string &log_path();

// Adds `2026-11-20T14:05:01Z PROGRAM: KIND: TEXT`, the time in UTC. Does nothing without a log. From any thread.
void log_line(LogKind kind, std::string_view text);

// errors  io  a line could not be written
Status log_status();

} // namespace pbm::command_line
