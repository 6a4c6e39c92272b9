// The layout of the points of a LAZ file, from its record "laszip encoded", and the positions of their chunks.
// Based on: Isenburg. LASzip: Lossless Compression of LiDAR Data. 2013
#pragma once

#include "pbm_scan/las/las_header.h"
#include "pbm_scan/surface/refusal.h"
#include "system/bytes.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pbm::build {

enum class LazField : std::uint16_t {
    bytes = 0,
    point10 = 6,
    time11 = 7,
    colour12 = 8,
    wave13 = 9,
    point14 = 10,
    colour14 = 11,
    colour_infrared14 = 12,
    wave14 = 13,
    bytes14 = 14
};

struct LazItem {
    LazField field{};
    std::size_t size = 0, offset = 0; // bytes of the record
    unsigned version = 0;
};

struct LazLayout {
    std::vector<LazItem> items; // side by side, they fill the record
    std::size_t stride = 0;     // of the record
    bool is_chunked = false, is_layered = false;
    std::uint32_t chunk_points = 0; // of each chunk but the last; kVariable: each chunk has its own number
    static constexpr std::uint32_t kVariable = 0xFFFFFFFF;
};

// errors  bad_input            the record is cut short, or contradicts the header
//         unsupported_feature  a compressor, coder or version of an item that is not known
Result<LazLayout> read_laz_layout(const LasHeader &header);

struct LazChunk {
    std::uint64_t offset = 0; // in the file; meaningless if the end of the previous chunk is unknown
    std::uint64_t bytes = 0;  // 0: unknown until the chunk is decoded
    std::uint64_t points = 0;
};

// Lists the chunks of `file` in their order, from its table of chunks. Their ends are unknown if the file has one chunk
// (before LASzip 2), or if the writer was interrupted before it wrote the table.
//
// errors  bad_input  the table is damaged, or places chunks outside the file, or contradicts the header or the chunks
Result<std::vector<LazChunk>> find_laz_chunks(ByteView file, const LasHeader &header, const LazLayout &layout);

// Upper bound of the points in a file of `bytes`: records of 200 times its size. No scan compresses that well.
inline std::uint64_t max_laz_points(std::uint64_t bytes, const LazLayout &layout) {
    return 200 * bytes / layout.stride;
}

} // namespace pbm::build
