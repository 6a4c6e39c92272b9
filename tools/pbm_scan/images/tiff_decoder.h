// TIFF images through libtiff. Called by image_decoder.
#pragma once

#include "pbm_scan/images/image_decoder.h"

namespace pbm::build {

// The first image of the file.
Result<ImageSize> tiff_size(ByteView bytes);
// As decode_rows. Rows are in the order of the file, whatever its orientation is.
//
// 8 bits and less, 16 bits, CMYK, palettes, YCbCr: sRGB. Floating point, and 16 bits whose transfer function is a
// straight line: linear light.
Status decode_tiff(ByteView bytes, std::size_t channels, const RowSink &take, ImageRemarks &remarks);
// Whether the samples are floating-point numbers.
bool is_float_tiff(ByteView bytes);
// As decode_linear, for such an image.
Result<std::vector<float>> decode_float_tiff(ByteView bytes);

} // namespace pbm::build
