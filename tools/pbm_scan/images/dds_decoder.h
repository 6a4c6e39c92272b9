// DDS images, compressed in blocks, through libsquish. Called by image_decoder.
// Based on: Microsoft. Programming Guide for DDS. 2022
#pragma once

#include "pbm_scan/images/image_decoder.h"

namespace pbm::build {

Result<ImageSize> dds_size(ByteView bytes);
// As decode_rows: the largest level of the first image. BC4 is grey, BC5 red and green.
//
// errors  unsupported_feature  other compressions than BC1 to BC5
Status decode_dds(ByteView bytes, std::size_t channels, const RowSink &take);

} // namespace pbm::build
