// Splat radii: indices of a table of twelve steps per doubling. BVG.md 6.2
#pragma once

#include <cstdint>

namespace pbm {

// Radius of an index in units of 2^-40 of the grid's edge: edge x 2^((i - 255) / 12), rounded down. BVG.md table 6.2.
std::uint64_t radius_fixed(std::uint8_t index);
// The same as a fraction of the grid's edge.
double radius_fraction(std::uint8_t index);
// Smallest index whose radius is at least `fraction` of the grid's edge (255 if none is).
std::uint8_t radius_index(double fraction);
// Smallest index that covers children of radius `child_index` from the centre of a node of `level` (6.2.3):
// radius >= child's radius + sqrt(3)/4 of the node's edge.
std::uint8_t covering_radius(std::uint8_t child_index, int level);
// At the finest level a radius is at most 5 % of the grid's edge.
inline constexpr std::uint8_t kMaxFinestRadius = 203;

} // namespace pbm
