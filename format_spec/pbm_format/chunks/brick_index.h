// The bricks of a chunk: 8x8x8 nodes of its level each, with the data that a renderer needs before it reads their
// points. Stored in mapped files, otherwise computed from decoded chunks. BVG.md 5.11
//
//   level L - 3   brick (x, y, z)                 one record
//   level L - 1   4x4x4 nodes of it: node_map     bit i: node i, in Morton order, is occupied and has a mask
//   level L       8x8x8 nodes: bits of the masks  the brick's points, in order
#pragma once

#include "pbm_format/container/layout.h"

#include <cstddef>

namespace pbm {

inline constexpr std::uint8_t kTwoSidedBrick = 1; // flag: a point of the brick is two-sided

// As stored in the file, 24 bytes.
struct BrickRecord {
    std::uint16_t x = 0, y = 0, z = 0; // of the brick in level L - 3
    std::uint16_t first_point = 0;     // within the chunk
    std::uint16_t first_node = 0;      // within the chunk: first of the brick's masks
    std::uint16_t cone_axis = 0;       // normal cone of its points: 5.11.3
    std::int16_t cone_cosine = kNoCone;
    std::uint8_t largest_radius = 0; // index
    std::uint8_t flags = 0;
    std::uint64_t node_map = 0;
    bool operator==(const BrickRecord &) const = default;
};
static_assert(sizeof(BrickRecord) == kBrickRecordBytes && offsetof(BrickRecord, node_map) == 16);

// The nodes of a chunk as its parent chunk stores them. Empty for level 1.
struct BrickParents {
    std::span<const BrickRecord> bricks; // of the parent chunk
    ByteView masks;                      // of the parent chunk
    std::size_t first = 0;               // first of these masks that belongs to a parent of the chunk's nodes
};

// The parents of the chunk `entry` in its parent chunk `above`, which has these bricks and masks.
BrickParents brick_parents(const ChunkEntry &entry, const ChunkEntry &above, std::span<const BrickRecord> bricks,
                           ByteView masks);

// Writes the records of a chunk of `level`, `to.size()` = shape.bricks of them, in one pass over its streams. Returns
// false if the chunk does not hold shape.bricks whole bricks below its root, or if its masks and its points differ in
// number. Accesses stay in bounds for any bytes in the arguments.
bool index_bricks(const BrickParents &parents, const ChunkShape &shape, int level, ByteView masks,
                  std::span<const std::uint16_t> normals, ByteView radii, std::span<BrickRecord> to);

} // namespace pbm
