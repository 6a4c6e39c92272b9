// libpng, to which the PNG writer is compared.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"

#include <string>

namespace pbm::bench {

// The pixels of a PNG file as RGBA; throws std::runtime_error.
Framebuffer read_png(const std::string &path);

// RGB if `opaque`, else RGBA. `fast`: libpng's fast format (zlib level 3, no filters), else its defaults (zlib level 6,
// filter chosen per row). Throws std::runtime_error.
Bytes write_png(const Framebuffer &picture, bool opaque, bool fast);

} // namespace pbm::bench
