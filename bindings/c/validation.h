// The part of validation that files and memory have in common.
#pragma once

#include "boundary.h"

#include <functional>

namespace pbm::c_api {

// Validates the bytes that `read` returns, once the structure is known to be right.
Status validate_bytes(pbm_validation *validation, const std::function<Result<ByteView>()> &read);

} // namespace pbm::c_api
