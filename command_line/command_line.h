// Common parts of all command lines: format of errors, destination of JSON, exit codes. A floor of its own between the
// format library and the programs; knows neither pixels nor scans.
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

struct CommandLine; // parse.h

// A word with a single dash, of the dissertation's program or of compilers (-MD), and its long option.
struct OldSwitch {
    std::string_view name;
    std::string_view option;
};

// Arguments without the program's name, prepared for CLI11: reversed and without single-dash words. `--json` alone
// becomes `--json=-` (standard output), so that it does not take a following file name as its value; `--sarif` and
// `--junit` likewise. Refuses the dissertation's switches that `switches` does not name.
//
// errors  usage  a switch of another program
Result<std::vector<std::string>> arguments(int argc, char **argv, std::span<const OldSwitch> switches = {});

// Escapes control characters as \n, \t or \x1b, so that the text fits on one line.
std::string printable(std::string_view text);
// The same as text of an attribute or element of XML and HTML: UTF-8 alone, and their own characters escaped.
std::string markup(std::string_view text);

// Prints `PROGRAM: PATH: MESSAGE` and the offset, if any, as one line on stderr and in the log. Where memory is short
// because the caller has limited this process, the line says so. Returns the exit code.
int fail(std::string_view program, std::string_view path, const Error &error);

// Prints `PROGRAM: MESSAGE; see PROGRAM --help` on standard error and returns 1.
int fail_usage(std::string_view program, std::string_view message);

// Prints `PROGRAM: warning: MESSAGE` as one line on standard error and in the log.
void warn(std::string_view program, std::string_view message);

// Whether two names refer to the same file, existing or not.
bool same_file(const std::string &a, const std::string &b);

// A file that a program writes, and the option that names it.
struct OutputFile {
    std::string_view option; // "--output"
    std::string name;
};

// Refuses outputs that would destroy something or fail in the end: an output that is an input or the log, two outputs
// of one name, an output that cannot be replaced. Prints the reason and returns the exit code. "" is no file; "-" is
// standard output, which takes one output.
std::optional<int> refuse_outputs(std::string_view program, std::span<const std::string> inputs,
                                  std::span<const OutputFile> outputs);

// Bytes: a whole number and an optional k, M, G or T (powers of 1024).
//
// errors  usage
Result<std::uint64_t> parse_bytes(const std::string &text);

// How messages call an output: "standard output" for "-".
std::string output_name(const std::string &path);

// Writes a picture or a report to a file, atomically but unsynced, or to standard output if `path` is "-".
Status write_bytes(const std::string &path, ByteView bytes);
Status write_text(const std::string &path, std::string_view text);

// Prints a page of help: it is no error if the reader of standard output does not want all of it ("| head").
void print_text(std::string_view text);

// Stream for a program's report: standard output, or standard error if one of `outputs` is standard output. Null if
// standard output is lost, or if it takes the JSON, which says the same.
std::ostream *report_stream(std::span<const OutputFile> outputs);

// Sets the file that is named in errors from exceptions (out of memory). Parsing the command line sets the first file;
// programs with several files call this for each.
void work_on(std::string_view path);

// The body of `main`: calls `run`. Exceptions become a line and exit code 4. A lost standard output, a failed log, or
// an input that is truncated while it is read becomes exit code 2. Writes the JSON of a failure (json_report.h).
int run_program(std::string_view program, const std::function<int()> &run);

} // namespace pbm::command_line
