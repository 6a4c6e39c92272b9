// Whether normals lie within a chunk's normal cone. BVG.md 5.7
#pragma once

#include "pbm_format/container/layout.h"
#include "pbm_format/streams/unfilter.h"

namespace pbm {

// For a cone that is one: its cosine is not kNoCone. Takes as long as to compare a hundred normals.
void mark_outside(const NormalCone &cone, OutsideCone &outside);
inline constexpr std::size_t kManyNormals = 512; // it pays from here on

// Whether the cone, which is one, holds all of these stored normals. `memory` is for many of them.
bool cone_holds(const NormalCone &cone, std::span<const std::uint16_t> normals, OutsideCone &memory);

// Narrowest cone around the mean of `normals` that holds them all.
NormalCone bound_normals(std::span<const std::uint16_t> normals);

// The cosine that the cone would need to hold all of them, x 32,767 and rounded down; none if a point is two-sided.
Value needed_cosine(const NormalCone &cone, std::span<const std::uint16_t> normals);

} // namespace pbm
