// Dependency files: the inputs of an output, in the syntax of Make, which Ninja and CMake read too.
#pragma once

#include "system/error.h"

#include <span>
#include <string>

namespace pbm::build {

// `target: file file ...` with gcc's escapes: a backslash before spaces and #, $$ for $. Names are not resolved. Then a
// rule without commands for each file, as `gcc -MP` writes it: when a file is removed, Make builds again instead of
// stopping. `is_always_due`: one of the files is never there, so that Make, Ninja and CMake call the command each time.
std::string depfile_text(const std::string &target, std::span<const std::string> files, bool is_always_due);

// Whether Make, Ninja and CMake all read `name` as the one file that it is.
//
// errors  usage  a name that one of them would misread; the message says by which character
Status check_depfile_name(const std::string &name);
Status check_depfile_target(const std::string &name);

} // namespace pbm::build
