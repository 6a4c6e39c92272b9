// Surface nets: the zero set of a signed distance as a closed triangle mesh of even density.
// Based on: Gibson. Constrained Elastic Surface Nets. 1998 (one vertex per cell that the surface crosses)
//           Latecki. 3D Well-Composed Pictures. 1997 (no ambiguous cells: the surface is a 2-manifold)
//
// The lattice is sparse: only blocks of 4x4x4 cells near the surface are evaluated.
#pragma once

#include "deterministic_math.h"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace pbm::sample {

// Negative inside. Need not be an exact distance, but where it is larger than the true one, parts of the surface that
// are not connected to others may be missed.
using DistanceField = std::function<double(const Vec3 &)>;

struct Box {
    Vec3 low, high;
};

// Triangles are counter-clockwise seen from outside. `normal` is the unit gradient of the field.
struct Isosurface {
    std::vector<glm::vec3> position, normal;
    std::vector<std::array<std::uint32_t, 3>> triangle;
};

// Extracts the surface on a lattice of edge `cell` > 0 that covers `box`, and cuts off what sticks out of the lattice.
// The result is closed and 2-manifold, in an order that depends on nothing but the arguments;
// `threads` (0: one per processor) do not change it. At most 2^31 lattice blocks and 2^32 - 1 vertices.
Isosurface extract_isosurface(const DistanceField &field, const Box &box, double cell, int threads);

// Keeps the connected piece with most vertices, of equals the first: drops splinters that hang in the air and bubbles
// inside. The order of what stays does not change.
void keep_largest_piece(Isosurface &surface);

} // namespace pbm::sample
