// What the command lines of all programs have in common: how errors read, where JSON goes, which exit code ends them.
// A floor of its own between the format library and the programs; knows neither pixels nor scans.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <functional>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::command_line {

// A word with a single dash, of the dissertation's program or of compilers (-MD), and the long option it stands for.
struct OldSwitch {
    std::string_view name;
    std::string_view option;
};

// Arguments after the program's name, ready for CLI11, which takes them reversed and knows no single-dash words.
// `--json` alone becomes `--json=-` (standard output), so that it never takes the file name that follows for its value.
// The dissertation's switches that `switches` does not name are refused here, the same for all programs.
//
// errors  usage  a switch of another program
Result<std::vector<std::string>> arguments(int argc, char **argv, std::span<const OldSwitch> switches = {});

// Text as it may stand within a line: control characters as \n, \t or \x1b, everything else as it is.
std::string printable(std::string_view text);

// Prints `PROGRAM: PATH: MESSAGE` in one line on standard error (and into the log) and returns the exit code. The
// offset is named where the error has one.
int fail(std::string_view program, std::string_view path, const Error &error);

// Prints `PROGRAM: MESSAGE; see PROGRAM --help` on standard error and returns 1.
int fail_usage(std::string_view program, std::string_view message);

// Whether two names mean one file, be it there or not.
bool same_file(const std::string &a, const std::string &b);

// Refuses, before any work, what would destroy something or fail in the end: an output that is an input, two outputs of
// one name, an output that is the log or cannot be replaced. Prints why and returns the exit code. "" is no file; "-"
// is standard output, which takes one output.
std::optional<int> refuse_outputs(std::string_view program, std::span<const std::string> inputs,
                                  std::span<const std::string> outputs);

// Bytes: a whole number and an optional k, M, G or T (powers of 1024).
//
// errors  usage
Result<std::uint64_t> parse_bytes(const std::string &text);

// Writes what is no model (a picture, a report) to a file, atomically but without waiting for the disk, or to standard
// output when `path` is "-".
Status write_bytes(const std::string &path, ByteView bytes);
Status write_text(const std::string &path, std::string_view text);

// Where a program tells what it did: standard output; standard error if one of `outputs` takes that; nowhere if it was
// lost, or if JSON takes it, which tells the same.
std::ostream *report_stream(std::span<const std::string> outputs, const std::string &json);

// Names the file that is worked on, for errors that come as exceptions (out of memory). Parsing the command line sets
// it to the first file; programs with several files call it for each.
void work_on(std::string_view path);

// The body of `main`: runs `run`, turns exceptions into a line and exit code 4, and a lost standard output or log or an
// input that becomes shorter while it is read into 2.
int run_program(std::string_view program, const std::function<int()> &run);

} // namespace pbm::command_line
