// The voxels of a small triangle, for all columns of a slab at once and without clipping. Where rounding could change
// the result it returns none, and the caller uses visit_voxels (triangle_voxels.h): the two together find exactly what
// visit_voxels finds alone.
// Based on: Akenine-Moeller. Fast 3D Triangle-Box Overlap Testing. 2001 (separating axes)
#pragma once

#include "pbm_build/lattice/lattice.h"

#include <array>
#include <cstddef>

namespace pbm::build {

// Maximum extent of a small triangle across its columns, in voxels.
inline constexpr std::size_t kSmallTriangle = 16;

// A column has at most three voxels, since the plane rises by less than two voxels over one. Two spare entries follow.
using SmallTriangleCodes = std::array<MortonCode, kSmallTriangle * kSmallTriangle * 3 + 2>;

// Writes the codes of all voxels whose interior the triangle enters to the front of `codes` and returns their number.
// 0: the triangle is not small, has no area, or rounding could change the result. Columns run along `depth_axis`, the
// axis closest to `normal`. The result does not depend on the order of the corners or on the processor.
std::size_t find_small_triangle(const std::array<LatticePoint, 3> &corners, const glm::dvec3 &normal, int depth_axis,
                                SmallTriangleCodes &codes);

} // namespace pbm::build
