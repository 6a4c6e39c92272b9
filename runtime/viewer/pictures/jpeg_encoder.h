// Encodes pictures and frames of videos as JPEG. The only user of libjpeg.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"
#include "system/error.h"

namespace pbm {

// Baseline JPEG with the standard Huffman tables, as Motion JPEG requires: chroma at half the resolution, alpha
// dropped. `quality`: 1..100, the IJG's scale. Callable from any thread. Produces the same bytes on every processor.
//
// errors  memory  the library fails
Result<Bytes> encode_jpeg(const Framebuffer &picture, int quality);

} // namespace pbm
