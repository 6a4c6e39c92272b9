// The bricks of a chunk: 8x8x8 nodes of its level each, with the data that a renderer needs before it reads their
// points. Stored in mapped files, otherwise computed from decoded chunks. BVG.md 5.11
//
//   level L - 3   brick (x, y, z)                 one record
//   level L - 1   4x4x4 nodes of it: node_map     bit i: node i, in Morton order, is occupied and has a mask
//   level L       8x8x8 nodes: bits of the masks  the brick's points, in order
#pragma once

#include "pbm_format/container/layout.h"

namespace pbm {

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

// Writes first point, first node, cone, largest radius and flags of records with place and node map, whose masks and
// points are all of these. Returns false if there are not as many. Accesses stay in bounds for any bytes.
bool bound_bricks(ByteView masks, std::span<const std::uint16_t> normals, ByteView radii, std::span<BrickRecord> to);

} // namespace pbm
