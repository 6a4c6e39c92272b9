// The model that is shown when none is named.
#pragma once

#include "system/error.h"

#include <string>

namespace pbm {

// The sample that was built and installed with this program, found from where the program lies.
//
// errors  io  it is not there; the message says how to make one
Result<std::string> sample_model();

} // namespace pbm
