// Dependency files: the inputs of an output, in the syntax of Make, which Ninja and CMake read too.
#pragma once

#include "system/error.h"

#include <span>
#include <string>

namespace pbm::build {

// `target: file file ...` with gcc's escapes: a backslash before spaces and #, $$ for $. Names are not resolved.
std::string depfile_text(const std::string &target, std::span<const std::string> files);

// Ninja has no escape for & ' * ? " ; | < > ` ^ and tabs: it would take the parts of such a name for files that are
// missing, and build again each time. Make has none for : ; and |, nor have CMake's Makefiles for backslashes.
//
// errors  usage  a name with one of these characters or another control character
Status check_depfile_name(const std::string &name);

} // namespace pbm::build
