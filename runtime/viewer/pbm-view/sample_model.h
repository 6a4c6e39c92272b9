// The model that pbm-view shows if none is named.
#pragma once

#include "system/error.h"

#include <string>

namespace pbm {

// Finds the sample that was built and installed with this program, by its path relative to the program.
//
// errors  io  it is not there; the message says how to make one
Result<std::string> sample_model();

} // namespace pbm
