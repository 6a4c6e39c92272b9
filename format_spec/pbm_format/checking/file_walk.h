// The one walk over a file that checks every rule of BVG.md: header, section table, padding and hashes, small sections,
// directories, chunks, rasters, and rules of the whole model. `validate` and `verify` are this walk.
//
// The walk continues after an error if there is something left to read. A hash that does not match explains any other
// fault of its section, which is then not reported.
#pragma once

#include "pbm_format/checking/validate.h"

namespace pbm {

enum class AfterError : std::uint8_t { go_on, stop };

// Throws the first error as an `Error` if `after_error` is stop. Also throws std::bad_alloc.
ValidationReport walk_file(ByteView file, const ValidateOptions &options, AfterError after_error);

} // namespace pbm
