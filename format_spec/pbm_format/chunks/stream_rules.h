// The unfiltered streams of a chunk: rules for their values. BVG.md 4 and 6
// All readers of chunks, packed or mapped, check these.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/law/catalogue.h"
#include "pbm_format/streams/unfilter.h"

namespace pbm {

// Properties of the file that the rules of a chunk depend on.
struct ChunkRules {
    const AttributeSet &set;
    std::size_t material_count;
    int level;
    bool finest;                     // level is the depth
    Wording wording = Wording::full; // of errors; errors of padding and bricks are always full
    unsigned left_out = 0;           // bits 1 << StreamKind of streams that are neither decoded nor verified; not masks

    bool leaves_out(StreamKind kind) const { return (left_out >> static_cast<unsigned>(kind) & 1) != 0; }
};

// `offset` in the file is that of the chunk for masks, else that of the stream.
Status check_masks(const MaskSummary &summary, std::uint32_t points, std::uint64_t offset,
                   Wording wording = Wording::full);
// Unfiltering cannot break this rule.
Status check_normals(std::span<const std::uint16_t> normals, std::uint64_t offset, Wording wording = Wording::full);
Status check_cone(std::span<const std::uint16_t> normals, const NormalCone &cone, OutsideCone &memory,
                  std::uint64_t offset, Wording wording = Wording::full);
// Checks the largest value of the stream; normals and the padding of lit fractions have their own functions.
Status check_values(const StreamInfo &stream, ByteView values, const ChunkRules &rules, std::uint64_t offset);
// Checks that the bits behind the last of the lit fractions, `bits` each, are zero.
Status check_packed_tail(ByteView packed, std::uint32_t points, unsigned bits, std::uint64_t offset,
                         Wording wording = Wording::full);

} // namespace pbm
