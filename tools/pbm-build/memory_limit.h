// --max-memory of one build.
#pragma once

#include "options/options.h"

#include <optional>
#include <string_view>

namespace pbm::build {

// Pages the heap of this process (system/processes/paged_heap.h). Without --max-memory the limit is a quarter of the
// machine's memory, and there is none if the folder takes no temporary files. Says where temporary files go, and how
// much room is there, if the inputs are likely to need any.
//
// Returns the exit code of an error: 2 if the folder of --temp-dir takes no temporary files.
std::optional<int> limit_memory(std::string_view program, const Arguments &arguments);

} // namespace pbm::build
