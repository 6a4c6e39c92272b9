// Surface nets: the zero set of a signed distance as a closed triangle mesh of even density.
// Based on: Gibson. Constrained Elastic Surface Nets. 1998 (one vertex per cell that the surface crosses); Latecki. 3D
// Well-Composed Pictures. 1997 (no ambiguous cells: the surface is a 2-manifold)
//
// The lattice is sparse: only blocks of 4x4x4 cells near the surface are evaluated.
#pragma once

#include "pbm-sample/noise/deterministic_math.h"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace pbm::sample {

// Negative inside; need not be an exact distance. Values above the distance may hide separate parts of the surface.
using DistanceField = std::function<double(const Vec3 &)>;

struct Box {
    Vec3 low, high;
};

// Triangles are counter-clockwise seen from outside. `normal` is the unit gradient of the field.
struct Isosurface {
    std::vector<glm::vec3> position, normal;
    std::vector<std::array<std::uint32_t, 3>> triangle;
};

// Extracts the surface on a lattice of edge `cell` > 0 that covers `box`; parts outside the lattice are cut off. The
// result is closed and 2-manifold, and its order depends on no thread count (`threads`, 0: one per processor). At most
// 2^31 lattice blocks and 2^32 - 1 vertices.
Isosurface extract_isosurface(const DistanceField &field, const Box &box, double cell, int threads);

// Keeps only the connected piece with the most vertices (the first of equals), without floating splinters and inner
// bubbles. The order of what remains does not change.
void keep_largest_piece(Isosurface &surface);

} // namespace pbm::sample
