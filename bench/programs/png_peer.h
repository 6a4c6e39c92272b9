// libpng, beside which the writer of pictures is measured.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"

#include <string>

namespace pbm::bench {

// The pixels of a PNG file as RGBA; throws std::runtime_error.
Framebuffer read_png(const std::string &path);

// RGB if `opaque`, else RGBA. `fast`: libpng's own choice for speed (zlib level 3, no filters), else its defaults (zlib
// level 6, filters chosen row by row). Throws std::runtime_error.
Bytes write_png(const Framebuffer &picture, bool opaque, bool fast);

} // namespace pbm::bench
