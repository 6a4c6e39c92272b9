// Dependency files: the inputs of an output, in the syntax of Make, which Ninja and CMake read too.
#pragma once

#include "system/error.h"

#include <span>
#include <string>

namespace pbm::build {

// `target: file file ...` with gcc's escapes: a backslash before spaces, tabs and #, $$ for $, and doubled backslashes
// before a space. Colons are not escaped, as in gcc: Ninja accepts them, CMake and Make have no common escape. Names
// are not resolved.
std::string depfile_text(const std::string &target, std::span<const std::string> files);

// errors  usage  a name with a line feed, or with a backslash at its end: the syntax cannot express it
Status check_depfile_name(const std::string &name);

} // namespace pbm::build
