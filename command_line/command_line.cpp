#include "command_line/command_line.h"

#include "command_line/error_log.h"
#include "command_line/json_report.h"
#include "system/files/descriptor.h"
#include "system/files/file_replacement.h"
#include "system/processes/this_process.h"
#include "system/threads/large_stack.h"
#include "system/utf8.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <new>
#include <utility>

namespace pbm::command_line {

namespace {

// The switches of the dissertation's program (its chapter 5), and today's programs that have them.
constexpr std::string_view kMakersAndViewers = "pbm-build, pbm-render and pbm-view";
constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kDissertation{
    {{"-AVI", "pbm-render and pbm-view"},
     {"-FLYING_CAMERA", "pbm-view"},
     {"-IGNORE_POINT_COLOURS", kMakersAndViewers},
     {"-BACKGROUND", kMakersAndViewers},
     {"-SHADOW", kMakersAndViewers},
     {"-TEXTURE", kMakersAndViewers},
     {"-ENVIRONMENT_MAP", kMakersAndViewers}}};

Status refuse_switch(const std::string &argument) {
    const auto known = std::find_if(kDissertation.begin(), kDissertation.end(),
                                    [&](const auto &each) { return each.first == argument; });
    if (known == kDissertation.end())
        return {};
    return usage_error(argument + " is a switch of " + std::string(known->second) + "; leave it out here");
}

} // namespace

Result<std::vector<std::string>> arguments(int argc, char **argv, std::span<const OldSwitch> switches) {
    std::vector<std::string> result(argv + std::min(argc, 1), argv + argc);
    for (std::string &argument : result) {
        if (argument == "--") // file names follow
            break;
        if (argument == "--json" || argument == "--sarif" || argument == "--junit")
            argument += "=-";
        if (argument.size() > 3 && argument.starts_with("--") && argument.find('=') == argument.size() - 1)
            return usage_error(argument + ": the value is missing");
        const auto old = std::find_if(switches.begin(), switches.end(),
                                      [&](const OldSwitch &known) { return known.name == argument; });
        if (old == switches.end()) {
            if (const Status refused = refuse_switch(argument); !refused)
                return refused.error();
            continue;
        }
        argument = old->option;
    }
    std::reverse(result.begin(), result.end());
    return result;
}

std::string printable(std::string_view text) {
    constexpr std::string_view kHex = "0123456789abcdef";
    std::string out;
    out.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(at < text.size() ? text[at] : 0); };
        // The two bytes of a C1 control character in UTF-8.
        const auto is_c1 = [&](std::size_t at) { return byte(at) == 0xC2 && byte(at + 1) >> 5 == 4; };
        if (const unsigned char c = byte(i); c == '\n' || c == '\t')
            out += c == '\n' ? "\\n" : "\\t";
        else if (c < 0x20 || c == 0x7F || is_c1(i) || (i > 0 && is_c1(i - 1)))
            (out += "\\x") += {kHex[c >> 4], kHex[c & 15]};
        else
            out += text[i];
    }
    return out;
}

std::string markup(std::string_view text) {
    const std::string line = printable(text);
    std::string out;
    for (std::string_view left = line; !left.empty();) {
        const Utf8Character character = utf8_character(left);
        const std::string_view bytes = left.substr(0, std::max<std::size_t>(character.bytes, 1));
        left.remove_prefix(bytes.size());
        const bool is_none = character.bytes == 0 || character.code == 0xFFFE || character.code == 0xFFFF;
        out += is_none         ? "\xEF\xBF\xBD"
               : bytes == "&"  ? "&amp;"
               : bytes == "<"  ? "&lt;"
               : bytes == ">"  ? "&gt;"
               : bytes == "\"" ? "&quot;"
                               : bytes;
    }
    return out;
}

namespace {

void say_error(std::string_view program, const std::string &line) {
    std::cout.flush();
    std::cerr << program << ": " << printable(line) << std::endl;
    log_line(LogKind::error, line);
}

std::string &file_worked_on() {
    static std::string path;
    return path;
}

} // namespace

void work_on(std::string_view path) { file_worked_on() = path; }

namespace {

// Whether a name is a URL: a scheme of at least two letters, "://".
bool is_url(std::string_view name) {
    const std::size_t end = name.find("://");
    return end != std::string_view::npos && end >= 2 &&
           std::all_of(name.begin(), name.begin() + static_cast<std::ptrdiff_t>(end),
                       [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '+'; });
}

// Who runs out of memory under a limit on its address space cannot use the memory that is free.
std::string with_limit(const Error &error) {
    const auto limit = error.code == ErrorCode::memory ? address_space_limit() : std::nullopt;
    const bool said = error.message.find("(ulimit -v)") != std::string::npos; // by a program that this one has run
    return !limit || said ? error.message
                          : error.message + "; this process may use " + std::to_string(*limit >> 20) +
                                " MiB of address space: raise the limit (ulimit -v)";
}

} // namespace

int fail(std::string_view program, std::string_view path, const Error &error) {
    std::string line(path);
    if (!path.empty())
        line += ": ";
    std::string message = with_limit(error);
    if (error.code == ErrorCode::io && is_url(path))
        message += "; this is a URL, and PBM reads and writes files: download or upload it with another program";
    note_failure(path, error, message);
    line += message;
    if (has_offset(error))
        line += " (offset " + std::to_string(error.offset) + ")";
    say_error(program, line);
    return exit_code(error.code);
}

int fail_usage(std::string_view program, std::string_view message) {
    note_failure("", {ErrorCode::usage}, std::string(message));
    say_error(program, std::string(message) + "; see " + std::string(program) + " --help");
    return exit_code(ErrorCode::usage);
}

void warn(std::string_view program, std::string_view message) {
    std::cout.flush();
    std::cerr << program << ": warning: " << printable(message) << std::endl;
    log_line(LogKind::warning, message);
}

bool same_file(const std::string &a, const std::string &b) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    if (fs::equivalent(a, b, ignored))
        return fs::is_regular_file(a, ignored); // two names of a device or pipe are harmless
    const auto full = [&](const std::string &name) {
        return fs::weakly_canonical(fs::absolute(name, ignored), ignored);
    };
    return full(a) == full(b) && !fs::exists(a, ignored);
}

namespace {

// What speaks against writing `outputs[i]`: a usage error or one of the system.
Status check_output(std::span<const std::string> inputs, std::span<const OutputFile> outputs, std::size_t i) {
    const auto is_file = [](const std::string &name) { return !name.empty() && name != "-"; };
    const auto &option = outputs[i].option;
    const std::string &name = outputs[i].name;
    const auto refuse = [&](const std::string &what) {
        return usage_error(name + ": " + what + "; choose another name");
    };
    if (!is_file(name))
        return {};
    for (const std::string &input : inputs)
        if (is_file(input) && same_file(input, name))
            return refuse(std::string(option) + " is an input");
    for (const OutputFile &other : outputs.first(i))
        if (is_file(other.name) && same_file(other.name, name))
            return refuse(std::string(option) + " and " + std::string(other.option) + " have this name");
    if (!log_path().empty() && same_file(log_path(), name))
        return refuse(std::string(option) + " is the log");
    return check_replaceable(name);
}

} // namespace

std::optional<int> refuse_outputs(std::string_view program, std::span<const std::string> inputs,
                                  std::span<const OutputFile> outputs) {
    if (std::count_if(outputs.begin(), outputs.end(), [](const OutputFile &file) { return file.name == "-"; }) > 1) {
        forget_json();
        return fail_usage(program, "standard output takes one output; name a file for the other");
    }
    for (std::size_t i = 0; i < outputs.size(); ++i)
        if (const Status writable = check_output(inputs, outputs, i); !writable) {
            if (outputs[i].option == "--json")
                forget_json();
            return writable.error().code == ErrorCode::usage ? fail_usage(program, writable.error().message)
                                                             : fail(program, outputs[i].name, writable.error());
        }
    json_may_be_written();
    return std::nullopt;
}

std::string output_name(const std::string &path) { return path == "-" ? "standard output" : path; }

namespace {

constexpr int kStandardOutput = 1; // descriptor

Error lost_output(int number) {
    return number == EBADF ? Error{ErrorCode::io, 0, "cannot write: it is closed"} : io_error("cannot write", number);
}

} // namespace

Status write_bytes(const std::string &path, ByteView bytes) {
    if (path != "-")
        return replace_file(path, bytes, Durability::cached);
    std::cout.flush();
    const int error = write_all(kStandardOutput, bytes);
    return error == 0 ? Status() : Status(lost_output(error));
}

Result<std::uint64_t> parse_bytes(const std::string &text) {
    std::uint64_t number = 0;
    const char *const end = text.data() + text.size();
    const auto [after, error] = std::from_chars(text.data(), end, number);
    const std::string_view rest(after, static_cast<std::size_t>(end - after));
    constexpr std::array<std::string_view, 5> kUnits{"", "k", "M", "G", "T"};
    const auto unit = std::find(kUnits.begin(), kUnits.end(), rest == "K" ? "k" : rest);
    const auto shift = 10 * (unit - kUnits.begin());
    if (error != std::errc() || unit == kUnits.end() || number == 0 || number > std::uint64_t{1} << (63 - shift))
        return usage_error("'" + text + "' is no amount of memory; write bytes like 500M or 8G");
    return number << shift;
}

std::ostream *report_stream(std::span<const OutputFile> outputs) {
    const auto at = std::find_if(outputs.begin(), outputs.end(), [](const OutputFile &output) {
        return output.name == "-" || output.name == "/dev/stdout";
    });
    if (at == outputs.end())
        return &std::cout;
    return at->option != "--json" && std::cout.flush() ? &std::cerr : nullptr;
}

Status write_text(const std::string &path, std::string_view text) { return write_bytes(path, as_bytes(text)); }

namespace {

int run_without_exceptions(std::string_view program, const std::function<int()> &run) {
    try {
        return run();
    } catch (const std::bad_alloc &) {
        const std::string advice = address_space_limit() ? "" : "; end other programs or choose a coarser model";
        return fail(program, file_worked_on(), {ErrorCode::memory, 0, "out of memory" + advice});
    } catch (const std::exception &error) {
        return fail(program, file_worked_on(), {ErrorCode::memory, 0, error.what()});
    }
}

// Flushes standard output; returns 0 or the system's number of an error. The C library forgets why an earlier write
// failed, and the same reason holds for one more byte.
int flush_standard_output() {
    const bool flushed = std::fflush(stdout) == 0;
    if (flushed && std::ferror(stdout) == 0 && std::cout.flush())
        return 0;
    const std::uint8_t line_feed = '\n';
    const int error = write_all(kStandardOutput, {&line_feed, 1});
    return error != 0 ? error : EIO;
}

bool &output_may_be_cut() {
    static bool may_be_cut = false;
    return may_be_cut;
}

} // namespace

void print_text(std::string_view text) {
    output_may_be_cut() = true;
    std::cout << text;
}

int run_program(std::string_view program, const std::function<int()> &run) {
    make_write_errors_returns();
    end_when_mapped_file_shrinks(program);
    int code = run_with_large_stack([&] { return run_without_exceptions(program, run); });
    if (const Status logged = log_status(); !logged) {
        const int lost = fail(program, log_path(), logged.error());
        code = code == 0 ? lost : code;
    }
    if (code != 0)
        write_failure(program, code);
    if (const int lost = flush_standard_output(); lost != 0 && code == 0 && !(lost == EPIPE && output_may_be_cut()))
        code = fail(program, output_name("-"), lost_output(lost));
    return code;
}

} // namespace pbm::command_line
