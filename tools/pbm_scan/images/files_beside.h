// Files that a scan names: material files, images, buffers.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <optional>
#include <string>
#include <string_view>

namespace pbm::build {

// The existing regular file that `scan` means by `name`: relative to its folder, with slashes of either kind, else
// without quotes around it, else by a folded name (folded_file_name), else by the last part of the name in the folder
// itself (for absolute paths of another computer).
std::optional<std::string> find_beside(const std::string &scan, std::string_view name);

// The same with what decides it.
NamedFile name_beside(const std::string &scan, std::string_view name);

// Why there is no such file, for the report.
std::string why_missing(std::string_view name);

// The name in the form that equals that of other spellings: ASCII letters in lower case, text that is no UTF-8 taken as
// Latin-1, and a letter with the mark that follows it as one character (macOS stores names with separate marks).
std::string folded_file_name(std::string_view name);

} // namespace pbm::build
