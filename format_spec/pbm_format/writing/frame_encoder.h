// The encoder of frames; frame.h undoes it. BVG.md 5.6 and 5.8.1
#pragma once

#include "system/bytes.h"

#include <cstdint>
#include <span>

namespace pbm {

struct StoredFrame {
    std::uint32_t stored_bytes = 0;
    bool zstd = false; // else the raw bytes
};

// Appends `raw` to `out` in the form that is smallest, or nearly smallest and much faster to decode: what filters leave
// is noise in which matches are rare, so a frame of nothing but Huffman-coded literals (1.5 GB/s) is preferred to one
// with matches (0.5 to 1 GB/s) unless matches save a fifth. Level 1 makes no other than Huffman frames; 2..19 try
// matches with zstd's level of that number. Deterministic for a version of zstd.
StoredFrame append_frame(ByteView raw, int compression_level, Bytes &out);

// Appends planes of a filter with their entries in front. BVG.md 5.8.1
void append_planes(std::span<const Bytes> planes, int compression_level, Bytes &out);

} // namespace pbm
