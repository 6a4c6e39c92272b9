// Layered LAZ chunks: points of formats 6 to 10, whose fields have an arithmetic code each, one behind the other.
// Based on: Isenburg. LASzip: Lossless Compression of LiDAR Data. 2013
#pragma once

#include "pbm_scan/las/laz_layout.h"

namespace pbm::build {

// What a layered chunk says of itself.
struct LayeredChunk {
    std::uint64_t bytes = 0; // the chunk's
    std::uint32_t points = 0;
};

// Reads the sizes of the layers behind the first point. `chunk` may go on behind the chunk's end.
//
// errors  bad_input  the chunk is longer than `chunk`, or has no points
Result<LayeredChunk> measure_layered(ByteView chunk, const LazLayout &layout);

// Decodes `records`: as many as measure_layered found, in `chunk` of exactly its size.
//
// errors  bad_input  the bytes are no such chunk
Status decode_layered(ByteView chunk, const LazLayout &layout, std::span<std::uint8_t> records);

} // namespace pbm::build
