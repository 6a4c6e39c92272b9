// The encoder of rasters and of the filter of their tiles; image_section.h and texel_filter.h undo them. BVG.md 3.10
// and 5.8.9
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/model/image.h"

#include <vector>

namespace pbm {

// Planes of the zigzags of differences: of the value for one channel; of G, R - G, B - G for three. `width` texels a
// row.
std::vector<Bytes> filter_texels(ByteView texels, std::size_t width, std::size_t channels);

// The whole section, mip levels included. The image is_storable. The same bytes for any thread count.
Bytes encode_image(const Image &image, Storage storage, int compression_level, int threads);

} // namespace pbm
