// Encodes frames; frame.h decodes them. BVG.md 5.6 and 5.8.1
#pragma once

#include "system/bytes.h"

#include <cstdint>
#include <span>
#include <string>

namespace pbm {

struct StoredFrame {
    std::uint32_t stored_bytes = 0;
    bool zstd = false; // false: raw bytes
};

// Appends `raw` to `out` in the smallest form, or in a nearly smallest one that decodes much faster. Filtered data are
// noise in which matches are rare. So a frame of only Huffman-coded literals (1.5 GB/s) is preferred to one with
// matches (0.5 to 1 GB/s) unless matches save a fifth. Level 1 makes only Huffman frames; levels 2..19 also try matches
// with zstd's level of that number. Deterministic for one version of zstd.
StoredFrame append_frame(ByteView raw, int compression_level, Bytes &out);

// "1.5.4": the version of zstd that runs.
std::string zstd_version();

// Appends planes of a filter after their entries. BVG.md 5.8.1
void append_planes(std::span<const Bytes> planes, int compression_level, Bytes &out);

} // namespace pbm
