// Tests whether normals lie within a chunk's normal cone. BVG.md 5.7
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/streams/unfilter.h"

namespace pbm {

// Marks the normals outside of `cone`, whose cosine must not be kNoCone. Costs as much as comparing a hundred normals.
void mark_outside(const NormalCone &cone, OutsideCone &outside);
inline constexpr std::size_t kManyNormals = 512; // normals from which mark_outside is faster than comparing

// Whether `cone`, whose cosine must not be kNoCone, holds all of these normals. `memory` is scratch for many normals.
bool cone_holds(const NormalCone &cone, std::span<const std::uint16_t> normals, OutsideCone &memory);

// The narrowest cone around the mean of `normals` that holds all of them.
NormalCone bound_normals(std::span<const std::uint16_t> normals);

// The cosine with which the cone would hold all normals, x 32,767, rounded down; text if a point is two-sided.
Value needed_cosine(const NormalCone &cone, std::span<const std::uint16_t> normals);

} // namespace pbm
