#include "command_line/command_line.h"

#include "pbm_format/platform.h"

#include <algorithm>
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

Status write_text(const std::string &path, std::string_view text) {
    if (path == "-") {
        std::cout << text;
        return {};
    }
    return replace_file(path, {reinterpret_cast<const std::uint8_t *>(text.data()), text.size()});
}

int run_program(std::string_view program, const std::function<int()> &run) {
    make_write_errors_returns();
    int code = 0;
    try {
        code = run();
    } catch (const std::bad_alloc &) {
        code = fail(program, "", {ErrorCode::memory, 0, "out of memory"});
    } catch (const std::exception &error) {
        code = fail(program, "", {ErrorCode::memory, 0, error.what()});
    }
    if (!std::cout.flush() && code == 0)
        code = fail(program, "", {ErrorCode::io, 0, "cannot write to standard output"});
    return code;
}

} // namespace pbm::command_line
