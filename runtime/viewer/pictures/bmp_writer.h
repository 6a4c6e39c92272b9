// Encodes pictures as BMP files, the format of the dissertation's program.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"
#include "system/error.h"

namespace pbm {

// Uncompressed, bottom row first: 24 bits per pixel if all are opaque, else 32 with straight alpha (BITMAPV4HEADER).
//
// errors  memory  larger than the format's limit of 4 GiB
Result<Bytes> encode_bmp(const Framebuffer &picture);

} // namespace pbm
