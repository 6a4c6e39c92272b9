// TGA, BMP, GIF, PNM, PSD and Radiance HDR images through stb_image. Called by image_decoder.
#pragma once

#include "pbm_scan/images/image_decoder.h"

namespace pbm::build {

// Whether the first bytes can be the header of a TGA image, which has no signature.
bool looks_like_tga(ByteView bytes);

Result<ImageSize> stb_size(ByteView bytes, ImageFormat format);
// As decode_rows. A GIF gives its first frame, a PSD its flattened picture.
Status decode_stb(ByteView bytes, ImageFormat format, std::size_t channels, const RowSink &take);
// As decode_linear.
Result<std::vector<float>> decode_hdr(ByteView bytes);

} // namespace pbm::build
