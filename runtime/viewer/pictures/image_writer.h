// Encodes pictures as bytes of image files; replace_file() writes them.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"
#include "system/error.h"

namespace pbm {

// PNG, 8 bits per channel, sRGB; RGB if every pixel is opaque, else RGBA with straight alpha. For speed, rows are
// filtered by the row above and compressed in bands of a fixed size, one chunk each; so the bytes do not depend on the
// number of threads (0: one per processor). The only user of ISA-L and zlib.
// Based on: PNG Specification (Third Edition), W3C 2025; RFC 1950, RFC 1951
//
// errors  memory  the deflate library fails
Result<Bytes> encode_png(const Framebuffer &picture, int threads = 1);

// PFM (portable float map) of the depths: one channel, little-endian, bottom row first, +infinity where empty.
Bytes encode_depth_pfm(const Framebuffer &picture);

} // namespace pbm
