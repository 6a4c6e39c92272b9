#include "web_page.h"

#include "command_line/command_line.h"
#include "command_line/web_viewer.h"
#include "system/processes/child_program.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <system_error>

namespace pbm::build {
namespace {

constexpr std::string_view kRenderer = "pbm-render";

// The command that makes the page of a model.
std::vector<std::string> page_command(const Arguments &arguments, const std::string &model) {
    std::vector<std::string> words{find_program(kRenderer), model, "--page=" + arguments.page};
    if (arguments.build.threads > 0)
        words.push_back("--threads=" + std::to_string(arguments.build.threads));
    std::istringstream view(arguments.page_view);
    for (std::string word; view >> word;)
        words.push_back(word);
    return words;
}

// Refuses options of --page-view before the build: without a model the command ends as soon as it understands them.
std::optional<int> check_view(std::string_view program, const Arguments &arguments) {
    const auto ended = run_program(page_command(arguments, "/dev/null"), [](std::string_view) {});
    if (!ended)
        return command_line::fail(program, "--page", ended.error());
    if (ended->exit_code == 0)
        return command_line::fail_usage(program, "--page-view " + arguments.page_view + ": this makes no page");
    if (ended->exit_code != exit_code(ErrorCode::usage))
        return std::nullopt;
    std::cerr << command_line::printable(ended->message) << '\n';
    return ended->exit_code;
}

} // namespace

PageFolder::~PageFolder() {
    std::error_code not_empty;
    if (!made_.empty())
        std::filesystem::remove(made_, not_empty);
}

std::optional<int> PageFolder::begin(std::string_view program, const Arguments &arguments) {
    if (arguments.page.empty())
        return std::nullopt;
    if (find_program(kRenderer).empty())
        return command_line::fail(program, "--page",
                                  {ErrorCode::memory, 0, "pbm-render makes the page, and it is not installed"});
    if (const auto viewer = command_line::find_web_viewer(arguments.page); !viewer)
        return command_line::fail(program, "--page", viewer.error());
    if (const auto refused = check_view(program, arguments))
        return refused;
    std::error_code error;
    if (std::filesystem::create_directories(arguments.page, error))
        made_ = arguments.page;
    if (!error)
        return std::nullopt;
    return command_line::fail(program, arguments.page,
                              {ErrorCode::io, 0, "cannot make this folder: " + error.message()});
}

std::optional<int> make_page(std::string_view program, const Arguments &arguments, std::ostream *report) {
    if (arguments.page.empty())
        return std::nullopt;
    const auto ended = run_program(page_command(arguments, arguments.output), [&](std::string_view line) {
        if (report != nullptr && arguments.verbosity >= command_line::Verbosity::normal)
            *report << line << '\n';
    });
    if (!ended)
        return command_line::fail(program, "--page", ended.error());
    if (ended->exit_code == 0)
        return std::nullopt;
    std::cerr << command_line::printable(ended->message) << '\n';
    return std::max(ended->exit_code, 1);
}

} // namespace pbm::build
