// 8,192 unit normals by subdivision of an octahedron, their table and their quantisation. BVG.md 6.1
// Based on: Botsch, Wiratanaya, Kobbelt. Efficient High Quality Rendering of Point Sampled Geometry. 2002, section 3.3;
// dissertation section 4.2
//
// Index, 13 bits:  [12..10] octant: bit 10 x < 0, bit 11 y < 0, bit 12 z < 0
//                  [9..0]   five base-4 digits, coarse to fine: 0 the middle triangle, 1 / 2 / 3 the one at the
//                           x / y / z corner
// Triangles are split at the planar midpoints of their edges; a normal is the direction of its triangle's centroid.
// Stability: stable.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace pbm {

inline constexpr int kNormalCount = 8192;
inline constexpr std::uint16_t kNormalIndexMask = 0x1FFF;
inline constexpr std::uint16_t kTwoSidedBit = 0x2000; // bit 13 of a stored normal; bits 14 and 15 are zero

using UnitVector = std::array<double, 3>;
using IntegerNormal = std::array<std::int32_t, 3>; // unit vector x 32,767, rounded half away from zero

// The vector c of rule 6.1.2, whose direction is the normal: integers, |x| + |y| + |z| = 96. Ignores bits 13..15.
std::array<int, 3> normal_lattice_sum(std::uint16_t index);

// [kNormalCount]; computed once with only + - * / sqrt of IEEE 754 doubles, so it is the same on every machine.
std::span<const UnitVector> normal_table();
std::span<const IntegerNormal> integer_normal_table();

// The octahedron, unfolded around +z into a square of 128 x 64 half-cells. Neighbours stay neighbours, except across
// the four edges that meet at -z. Cell u + 128 v of an index, and index of a cell: [kNormalCount]. BVG.md 5.8.3
std::span<const std::uint16_t> normal_cells();
std::span<const std::uint16_t> normals_of_cells();

// Index of the table entry nearest in angle to (x, y, z); ties give the lowest index. The zero vector gives index 0.
// Sums of the components must neither overflow nor underflow.
std::uint16_t quantise_normal(double x, double y, double z);
inline std::uint16_t quantise_normal(const std::array<std::int64_t, 3> &v) {
    return quantise_normal(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]));
}

} // namespace pbm
