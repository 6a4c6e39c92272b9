// Rules that tie the parts of a file together, which the reader and the validator prove alike: hashes and padding of
// sections, counts that two places tell, and what only the whole model shows. BVG.md 2.18, 3.2.12, 3.2.14, 5.2, 5.5.11,
// 7.1, 8.1
#pragma once

#include "pbm_format/container/layout.h"

namespace pbm {

// `stored` are the bytes of the section.
Status prove_hash(ByteView stored, const SectionEntry &section);
// Bytes `from` to `to` of the file are zero.
Status check_padding(ByteView file, std::uint64_t from, std::uint64_t to);
Status check_point_count(const FileHeader &header, const SectionEntry &finest_chunks);
// `entry` is one of `sections`: the section table is what the directory contradicts.
Status check_chunk_count(const LevelDirectory &directory, const SectionEntry &entry,
                         std::span<const SectionEntry> sections);
Status check_content_id(const FileHeader &header, const ContentId &id);

// The error of a chunk that differs from the one that the octree gives; null where there is none.
Error wrong_split(std::uint64_t offset, const ChunkShape *expected, const ChunkShape *actual);

// The first point of a level, and of its attributes the first, that is no average.
struct WrongAverage {
    std::size_t point;
    const char *attribute;
    Value expected, actual; // of a colour the first byte that differs
};
WrongAverage find_wrong_average(const PointAttributes &stored, const PointAttributes &computed,
                                const AttributeSet &set);
Error wrong_averages(std::uint64_t offset, std::size_t level, const WrongAverage &first);

} // namespace pbm
