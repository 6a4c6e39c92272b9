// The voxels of a small triangle, all columns of a slab at once and without cutting it. In close calls, where rounding
// would decide, it leaves the answer to visit_voxels (triangle_voxels.h): together they find what that finds alone.
// Based on: Akenine-Moeller. Fast 3D Triangle-Box Overlap Testing. 2001 (separating axes)
#pragma once

#include "pbm_build/grid/lattice.h"

#include <array>
#include <cstddef>
#include <span>

namespace pbm::build {

// Voxels that a small triangle may be wide, across its columns.
inline constexpr std::size_t kSmallTriangle = 16;

// At most three in a column: its plane rises by less than two voxels over one. Two more are written past the end.
using SmallTriangleCodes = std::array<MortonCode, kSmallTriangle * kSmallTriangle * 3 + 2>;

// Finds the codes of all voxels whose inside the triangle enters and writes them to the front of `codes`, how many
// there are is returned: none, where the triangle is not small, has no area, or a decision is a close one. Columns run
// along `depth_axis`, the axis closest to `normal`. The same for any order of the corners, on every processor.
std::size_t find_small_triangle(const std::array<LatticePoint, 3> &corners, const glm::dvec3 &normal, int depth_axis,
                                SmallTriangleCodes &codes);

} // namespace pbm::build
