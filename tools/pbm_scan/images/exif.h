// The orientation of photographs.
#pragma once

#include "pbm_scan/images/image_decoder.h"

namespace pbm::build {

// 1..8, as Exif numbers them: 1 is upright. 1 too where the image says nothing, and of a TIFF, whose decoder knows
// it. Images keep the rows of their file, as glTF wants, whatever this says.
std::uint8_t exif_orientation(ByteView image, ImageFormat format);

} // namespace pbm::build
