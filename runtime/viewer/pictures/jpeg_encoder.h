// Frames of videos as JPEG. The only user of libjpeg.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"
#include "system/error.h"

namespace pbm {

// Baseline JPEG with the standard Huffman tables, as Motion JPEG wants it: chroma at half the resolution, alpha
// dropped. `quality`: 1..100, the IJG's scale. Any thread. The same bytes on every processor.
//
// errors  memory  the library refuses
Result<Bytes> encode_jpeg(const Framebuffer &picture, int quality);

} // namespace pbm
