// Pictures as BMP files, as the dissertation's program saved them.
#pragma once

#include "pbm_format/bytes.h"
#include "pbm_format/error.h"
#include "pbm_render/framebuffer.h"

namespace pbm {

// Windows bitmap, not compressed, bottom row first: 24 bits per pixel if every pixel is opaque, else 32 with straight
// alpha (BITMAPV4HEADER).
//
// errors  memory  more than the 4 GiB that the format can count
Result<Bytes> encode_bmp(const Framebuffer &picture);

} // namespace pbm
