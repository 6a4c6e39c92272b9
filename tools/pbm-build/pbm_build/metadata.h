// The metadata section of a file: who made what from which options. Nothing normative, nothing about this machine.
#pragma once

#include "pbm_build/pipeline.h"

namespace pbm::build {

// JSON object: credits, and of the options those that were given and shape the file. `colour`: as the file has it.
//
// errors  usage  not UTF-8, or longer than 4 KB
Result<std::string> make_metadata(const BuildOptions &build, ColourFormat colour);

} // namespace pbm::build
