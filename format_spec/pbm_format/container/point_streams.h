// Byte layout of the directories of optional streams of points. BVG.md 19.2
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/hashes/hash.h"

namespace pbm {

// The stream of one chunk; most chunks have none of their points in it, and no bytes.
struct PointStreamEntry {
    std::uint64_t hash = 0; // XXH3-64 of the stored bytes
    std::uint32_t stored_bytes = 0, raw_bytes = 0;
    bool zstd = false;        // one zstd frame, else raw bytes
    std::uint64_t offset = 0; // of the stored bytes in the file; computed by decode_stream_directory

    FileRange range() const { return {offset, stored_bytes}; }
};

inline constexpr std::size_t kPointStreamEntryBytes = 16;
inline constexpr std::uint64_t kMaxPointStreamBytes = 32; // raw bytes of a point

// `level`: the directory of the chunks; `values`: the section of the values. Error offsets count from the start of the
// directory. Returns an entry for each chunk.
//
// errors  bad_directory        19.2.1, 19.2.3, 19.2.5
//         unsupported_feature  19.2.2
//         too_large            19.2.4
Result<std::vector<PointStreamEntry>> decode_stream_directory(ByteView bytes, const LevelDirectory &level,
                                                              const SectionEntry &values);
Bytes encode_stream_directory(std::span<const PointStreamEntry> entries);

} // namespace pbm
