// Files that a scan names: material files, images, buffers.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <optional>
#include <string>
#include <string_view>

namespace pbm::build {

// The existing regular file that `scan` means by `name`: relative to its folder, with slashes of either kind, else in
// another case, else by the last part of the name in the folder itself (for absolute paths of another computer).
std::optional<std::string> find_beside(const std::string &scan, std::string_view name);

// The same with what decides it.
NamedFile name_beside(const std::string &scan, std::string_view name);

} // namespace pbm::build
