// The error log of --log: errors, warnings and progress, one line each, appended to a file. One per process.
#pragma once

#include "system/error.h"

#include <string>
#include <string_view>

namespace pbm::command_line {

enum class LogKind { error, warning, progress };

// Opens `path` for `program`; creates the file or appends to it. Several processes may share a log: each line is one
// write. Call before starting threads.
//
// errors  io  the system's own text
Status open_log(std::string_view program, const std::string &path);

// Name of the log; empty without a log.
const std::string &log_path();

// Appends `2026-11-20T14:05:01Z PROGRAM: KIND: TEXT`, the time in UTC. Does nothing without a log. Thread-safe.
void log_line(LogKind kind, std::string_view text);

// errors  io  a line could not be written
Status log_status();

} // namespace pbm::command_line
