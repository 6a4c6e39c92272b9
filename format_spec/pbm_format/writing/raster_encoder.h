// Encodes rasters and filters their tiles; image_section.h and texel_filter.h invert that. BVG.md 3.10 and 5.8.9
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/model/model.h"

#include <vector>

namespace pbm {

// Planes of zigzag-coded differences: of one channel, or of G, R - G, B - G. Rows have `width` texels.
std::vector<Bytes> filter_texels(ByteView texels, std::size_t width, std::size_t channels);

// Encodes the whole section with its mip levels. `image` must be storable. The result is the same for any thread count.
Bytes encode_image(const Image &image, Storage storage, int compression_level, int threads);

} // namespace pbm
