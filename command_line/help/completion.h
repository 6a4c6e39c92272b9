// Completion of command lines for bash, zsh and fish, from the same description as help and man page.
#pragma once

#include "command_line/help/help.h"

#include <optional>
#include <string>
#include <string_view>

namespace pbm::command_line {

// The script that makes `shell` complete the options of a program, their values (words, names of files; none for
// numbers) and names of files. "bash": for bash-completion's folder or `source`; "zsh": a function of fpath named after
// the program with "_" before it; "fish": a file of vendor_completions.d. Absent for another shell.
std::optional<std::string> completion_script(const ProgramHelp &help, std::string_view shell);

} // namespace pbm::command_line
