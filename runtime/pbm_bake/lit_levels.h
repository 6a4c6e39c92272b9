// Lit fractions of all detail levels from those of the finest one. BVG.md 7.8
#pragma once

#include "pbm_format/model/octree.h"
#include "system/bytes.h"

#include <cstdint>
#include <span>
#include <vector>

namespace pbm {

// `masks`: the octree, [depth + 1]. `bits`: of a lit fraction at each level, 1, 2, 4 or 8. `finest`: 0..2^bits - 1 of
// each point. Returns [depth + 1][points of the level]: the means that a file stores, scaled to 0..255.
//
// throws  std::bad_alloc
std::vector<Bytes> lit_levels(const LevelMasks &masks, std::span<const std::uint8_t> bits, ByteView finest);

} // namespace pbm
