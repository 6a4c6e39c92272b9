// The unfiltered streams of a chunk: their bytes, and the rules for their values. BVG.md sections 4 and 6.
// Whoever reads chunks, from frames or where they lie, proves these.
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/law/catalogue.h"
#include "pbm_format/streams/unfilter.h"

namespace pbm {

// `offset` is that of the chunk for masks, else of the stream, in the file.
Status check_masks(const MaskSummary &summary, std::uint32_t points, std::uint64_t offset,
                   Wording wording = Wording::full);
// Un-filtering cannot break this rule.
Status check_normals(std::span<const std::uint16_t> normals, std::uint64_t offset, Wording wording = Wording::full);
Status check_cone(std::span<const std::uint16_t> normals, const NormalCone &cone, OutsideCone &memory,
                  std::uint64_t offset, Wording wording = Wording::full);
Status check_radii(ByteView radii, bool finest, std::uint64_t offset, Wording wording = Wording::full);
Status check_materials(ByteView materials, std::size_t material_count, std::uint64_t offset,
                       Wording wording = Wording::full);
// Of lit fractions, `bits` each: nothing behind the last.
Status check_packed_tail(ByteView packed, std::uint32_t points, unsigned bits, std::uint64_t offset,
                         Wording wording = Wording::full);

} // namespace pbm
