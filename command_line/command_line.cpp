#include "command_line/command_line.h"

#include "command_line/error_log.h"
#include "system/files/file_replacement.h"
#include "system/processes/this_process.h"
#include "system/threads/large_stack.h"

#include <algorithm>
#include <array>
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
    return Error{ErrorCode::usage, 0,
                 argument + " is a switch of " + std::string(known->second) + "; leave it out here"};
}

} // namespace

Result<std::vector<std::string>> arguments(int argc, char **argv, std::span<const OldSwitch> switches) {
    std::vector<std::string> result(argv + std::min(argc, 1), argv + argc);
    for (std::string &argument : result) {
        if (argument == "--") // file names follow
            break;
        if (argument == "--json")
            argument = "--json=-";
        if (argument.size() > 3 && argument.starts_with("--") && argument.find('=') == argument.size() - 1)
            return Error{ErrorCode::usage, 0, argument + ": the value is missing"};
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

int fail(std::string_view program, std::string_view path, const Error &error) {
    std::string line(path);
    if (!path.empty())
        line += ": ";
    line += error.message;
    if (has_offset(error))
        line += " (offset " + std::to_string(error.offset) + ")";
    say_error(program, line);
    return exit_code(error.code);
}

int fail_usage(std::string_view program, std::string_view message) {
    say_error(program, std::string(message) + "; see " + std::string(program) + " --help");
    return exit_code(ErrorCode::usage);
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

std::optional<int> refuse_outputs(std::string_view program, std::span<const std::string> inputs,
                                  std::span<const std::string> outputs) {
    const auto is_file = [](const std::string &name) { return !name.empty() && name != "-"; };
    if (std::count(outputs.begin(), outputs.end(), "-") > 1)
        return fail_usage(program, "standard output takes one output; name a file for the other");
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        const std::string &output = outputs[i];
        if (!is_file(output))
            continue;
        for (const std::string &input : inputs)
            if (is_file(input) && same_file(input, output))
                return fail_usage(program, output + ": the output is the input; choose another name");
        for (std::size_t j = 0; j < i; ++j)
            if (is_file(outputs[j]) && same_file(outputs[j], output))
                return fail_usage(program, output + ": two outputs have this name; choose another one");
        if (!log_path().empty() && same_file(log_path(), output))
            return fail_usage(program, output + ": the output is the log; choose another name");
        if (const Status replaceable = check_replaceable(output); !replaceable)
            return fail(program, output, replaceable.error());
    }
    return std::nullopt;
}

Status write_bytes(const std::string &path, ByteView bytes) {
    if (path != "-")
        return replace_file(path, bytes, Durability::cached);
    std::cout.write(reinterpret_cast<const char *>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return {};
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
        return Error{ErrorCode::usage, 0, "'" + text + "' is no amount of memory; write bytes like 500M or 8G"};
    return number << shift;
}

std::ostream *report_stream(std::span<const std::string> outputs, const std::string &json) {
    const auto takes_stdout = [](const std::string &name) { return name == "-" || name == "/dev/stdout"; };
    if (takes_stdout(json))
        return nullptr;
    if (std::none_of(outputs.begin(), outputs.end(), takes_stdout))
        return &std::cout;
    return std::cout.flush() ? &std::cerr : nullptr;
}

Status write_text(const std::string &path, std::string_view text) {
    return write_bytes(path, {reinterpret_cast<const std::uint8_t *>(text.data()), text.size()});
}

namespace {

int run_without_exceptions(std::string_view program, const std::function<int()> &run) {
    try {
        return run();
    } catch (const std::bad_alloc &) {
        return fail(program, file_worked_on(),
                    {ErrorCode::memory, 0, "out of memory; end other programs or choose a coarser model"});
    } catch (const std::exception &error) {
        return fail(program, file_worked_on(), {ErrorCode::memory, 0, error.what()});
    }
}

} // namespace

int run_program(std::string_view program, const std::function<int()> &run) {
    make_write_errors_returns();
    end_when_mapped_file_shrinks(program);
    int code = run_with_large_stack([&] { return run_without_exceptions(program, run); });
    const bool printed = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
    if ((!std::cout.flush() || !printed) && code == 0)
        code = fail(program, "", {ErrorCode::io, 0, "cannot write to standard output"});
    if (const Status logged = log_status(); !logged && code == 0)
        code = fail(program, log_path(), logged.error());
    return code;
}

} // namespace pbm::command_line
