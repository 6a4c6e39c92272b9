#include "command_line/command_line.h"

#include "pbm_format/platform.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <new>

namespace pbm::command_line {

Result<std::vector<std::string>> arguments(int argc, char **argv, std::span<const OldSwitch> switches) {
    std::vector<std::string> result(argv + std::min(argc, 1), argv + argc);
    for (std::string &argument : result) {
        if (argument == "--json")
            argument = "--json=-";
        const auto old = std::find_if(switches.begin(), switches.end(),
                                      [&](const OldSwitch &known) { return known.name == argument; });
        if (old == switches.end())
            continue;
        if (old->option.empty())
            return Error{ErrorCode::unsupported_feature, 0, argument + " is not in this version; leave it out"};
        argument = old->option;
    }
    std::reverse(result.begin(), result.end());
    return result;
}

int fail(std::string_view program, std::string_view path, const Error &error) {
    std::cout.flush();
    std::cerr << program << ": ";
    if (!path.empty())
        std::cerr << path << ": ";
    std::cerr << error.message;
    if (error.offset != 0)
        std::cerr << " (offset " << error.offset << ')';
    std::cerr << std::endl;
    return exit_code(error.code);
}

int fail_usage(std::string_view program, std::string_view message) {
    std::cout.flush();
    std::cerr << program << ": " << message << "; see " << program << " --help" << std::endl;
    return exit_code(ErrorCode::usage);
}

namespace {

bool same_file(const std::string &a, const std::string &b) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    if (fs::equivalent(a, b, ignored))
        return fs::is_regular_file(a, ignored); // two names of a device or pipe are no harm
    const auto full = [&](const std::string &name) {
        return fs::weakly_canonical(fs::absolute(name, ignored), ignored);
    };
    return full(a) == full(b) && !fs::exists(a, ignored);
}

} // namespace

std::optional<int> refuse_outputs(std::string_view program, std::span<const std::string> inputs,
                                  std::span<const std::string> outputs) {
    const auto is_file = [](const std::string &name) { return !name.empty() && name != "-"; };
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
        if (const Status replaceable = check_replaceable(output); !replaceable)
            return fail(program, output, replaceable.error());
    }
    return std::nullopt;
}

Status write_text(const std::string &path, std::string_view text) {
    if (path == "-") {
        std::cout << text;
        return {};
    }
    return replace_file(path, {reinterpret_cast<const std::uint8_t *>(text.data()), text.size()});
}

int run_program(std::string_view program, const std::function<int()> &run) {
    make_write_errors_returns();
    end_when_mapped_file_shrinks(program);
    int code = 0;
    try {
        code = run();
    } catch (const std::bad_alloc &) {
        code = fail(program, "", {ErrorCode::memory, 0, "out of memory"});
    } catch (const std::exception &error) {
        code = fail(program, "", {ErrorCode::memory, 0, error.what()});
    }
    const bool printed = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
    if ((!std::cout.flush() || !printed) && code == 0)
        code = fail(program, "", {ErrorCode::io, 0, "cannot write to standard output"});
    return code;
}

} // namespace pbm::command_line
