// The unfiltered streams of a chunk: their bytes, and the rules for their values. BVG.md sections 4 and 6.
// Whoever reads chunks, from frames or where they lie, proves these.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/law/catalogue.h"
#include "pbm_format/streams/unfilter.h"

namespace pbm {

// What the rules of a chunk need to know of its file.
struct ChunkRules {
    const AttributeSet &set;
    std::size_t material_count;
    int level;
    bool finest;                     // level is the depth
    Wording wording = Wording::full; // of errors; those of padding and bricks always say all
};

// `offset` is that of the chunk for masks, else of the stream, in the file.
Status check_masks(const MaskSummary &summary, std::uint32_t points, std::uint64_t offset,
                   Wording wording = Wording::full);
// Un-filtering cannot break this rule.
Status check_normals(std::span<const std::uint16_t> normals, std::uint64_t offset, Wording wording = Wording::full);
Status check_cone(std::span<const std::uint16_t> normals, const NormalCone &cone, OutsideCone &memory,
                  std::uint64_t offset, Wording wording = Wording::full);
// The largest value that the stream may have; normals and the padding of lit fractions have rules of their own.
Status check_values(const StreamInfo &stream, ByteView values, const ChunkRules &rules, std::uint64_t offset);
// Of lit fractions, `bits` each: nothing behind the last.
Status check_packed_tail(ByteView packed, std::uint32_t points, unsigned bits, std::uint64_t offset,
                         Wording wording = Wording::full);

} // namespace pbm
