// Dependency files: what an output was made from, in the syntax of Make, which Ninja and CMake read too.
#pragma once

#include "system/error.h"

#include <span>
#include <string>

namespace pbm::build {

// `target: file file ...` with gcc's escapes: a backslash before spaces, tabs and #, $$ for $, and backslashes doubled
// where they stand before a space. Colons stay, as gcc leaves them: Ninja takes them so, CMake understands no escape,
// and Make has none that both read. Names stay relative or absolute as they are.
std::string depfile_text(const std::string &target, std::span<const std::string> files);

// errors  usage  a name with a line feed, or with a backslash at its end: the syntax has no way to write it
Status check_depfile_name(const std::string &name);

} // namespace pbm::build
