// --page: a page that shows the model.
#pragma once

#include "options/options.h"

#include <iosfwd>
#include <optional>
#include <string_view>

namespace pbm::build {

// Makes the folder, so that the output can be written there.
//
// Returns the exit code of an error.
std::optional<int> begin_page(std::string_view program, const Arguments &arguments);

// Runs pbm-render --page for the output, which is there. Its report goes to `report`, which may be null.
//
// Returns the exit code of an error: that of pbm-render; 4: it is not installed.
std::optional<int> make_page(std::string_view program, const Arguments &arguments, std::ostream *report);

} // namespace pbm::build
