// Pointwise LAZ chunks: one arithmetic code, in which the fields of points of formats 0 to 5 follow one another.
// Based on: Isenburg. LASzip: Lossless Compression of LiDAR Data. 2013
#pragma once

#include "pbm_scan/las/laz_layout.h"

namespace pbm::build {

// Decodes `records`: whole records of `layout`, at least one. The chunk begins at the first byte of `chunk`, which may
// go on behind its end. Returns its size in bytes.
//
// errors  bad_input  the bytes are no such chunk, or end too early
Result<std::size_t> decode_pointwise(ByteView chunk, const LazLayout &layout, std::span<std::uint8_t> records);

} // namespace pbm::build
