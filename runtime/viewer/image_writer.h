// Pictures as bytes of image files; writing them is pbm::replace_file's work.
#pragma once

#include "pbm_format/bytes.h"
#include "pbm_format/error.h"
#include "pbm_render/framebuffer.h"

namespace pbm {

// PNG, 8 bits per channel, sRGB; RGB if every pixel is opaque, else RGBA with straight alpha. The only user of libpng.
Result<Bytes> encode_png(const Framebuffer &picture);

// PFM (portable float map) of the depths: one channel, little-endian, bottom row first, +infinity where empty.
Bytes encode_depth_pfm(const Framebuffer &picture);

} // namespace pbm
