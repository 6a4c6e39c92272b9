// Pictures as BMP files, as the dissertation's program saved them.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"
#include "system/error.h"

namespace pbm {

// Windows bitmap, not compressed, bottom row first: 24 bits per pixel if every pixel is opaque, else 32 with straight
// alpha (BITMAPV4HEADER).
//
// errors  memory  more than the 4 GiB that the format can count
Result<Bytes> encode_bmp(const Framebuffer &picture);

} // namespace pbm
