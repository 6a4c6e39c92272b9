// pbm-build --batch: builds the scans of a list or folder, and says how it went.
#pragma once

#include "options/options.h"

#include <string_view>

namespace pbm::build {

// Prints a line for each scan as its build ends, progress, and a table at the end; with --json a line of JSON for each
// scan. Returns 0, or the exit code of the first scan of the list that failed.
int run_batch(std::string_view program, const Arguments &arguments);

} // namespace pbm::build
